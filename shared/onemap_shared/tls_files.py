"""Certificates and keys that an endpoint or a router's file names, read before Zenoh reads them.

Zenoh's own error for a key that it cannot read names neither the key nor the reason.
"""
# Touches files: certificates and keys.

from __future__ import annotations

import re
from collections.abc import Iterable

IN_ENDPOINT = re.compile(r"_file=([^;]+)")  # tls/host:port#root_ca_certificate_file=...;...
IN_FILE = re.compile(r'"(/[^"]+\.(?:pem|key|crt))"')  # a router's JSON5


class UnreadableFile(Exception):
    """A certificate or key cannot be read; the text is one sentence for the user."""


def refuse_unreadable(endpoints: Iterable[str], router_file: str = "") -> None:
    """Raise UnreadableFile for the first file that cannot be read.

    endpoints: of Zenoh; router_file: the content of a router's configuration.
    """
    names = [name for endpoint in endpoints for name in IN_ENDPOINT.findall(endpoint)]
    for name in [*names, *IN_FILE.findall(router_file)]:
        try:
            with open(name, "rb"):
                pass
        except OSError as problem:
            raise UnreadableFile(
                f"cannot read {name}: {problem.strerror}. Give the file to the user that this "
                "process runs as, and to nobody else"
            ) from None
