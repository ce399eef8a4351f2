"""Writes the certificates of a bus to a folder; what is there is kept."""

from __future__ import annotations

import os
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

from onemap_shared.keys import ROLES
from onemap_tools.certificates import Identity, make_authority, sign
from onemap_tools.errors import CliError

AUTHORITY, ROUTER = "ca", "router"


def write_certificates(
    folder: Path, hosts: Sequence[str], *, now: datetime, days: int
) -> dict[str, bool]:
    """Certificates of the authority, the router and every role; whether each is new.

    A private key is readable by its owner alone. Raises CliError.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        kept = _read(folder, AUTHORITY)
        authority = kept or make_authority(now)
        made = {AUTHORITY: kept is None}
        if kept is None:
            _write(folder, AUTHORITY, authority)
        for name in (ROUTER, *ROLES):
            made[name] = _read(folder, name) is None
            if made[name]:
                names = hosts if name == ROUTER else ()
                _write(folder, name, sign(authority, name, names, now=now, days=days))
    except OSError as problem:
        raise CliError(f"Cannot write {problem.filename}: {problem.strerror}.") from problem
    except ValueError as problem:
        raise CliError(f"Cannot sign with {folder / AUTHORITY}.key: {problem}.") from problem
    return made


def _read(folder: Path, name: str) -> Identity | None:
    """The identity in the folder; None if there is none."""
    certificate, key = folder / f"{name}.pem", folder / f"{name}.key"
    if certificate.exists() != key.exists():
        missing = key if certificate.exists() else certificate
        raise CliError(f"{missing} is missing beside its other half: bring it, or remove both.")
    return Identity(certificate.read_bytes(), key.read_bytes()) if key.exists() else None


def _write(folder: Path, name: str, identity: Identity) -> None:
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
    for suffix, content, mode in (
        ("key", identity.key, 0o600),
        ("pem", identity.certificate, 0o644),
    ):
        with os.fdopen(os.open(folder / f"{name}.{suffix}", flags, mode), "wb") as file:
            file.write(content)
