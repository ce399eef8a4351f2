"""A model hub on loopback: what the hub's client asks of it."""

from __future__ import annotations

import hashlib
import json
import re
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

POLL_S = 0.01  # between two checks whether the server is shut down
COMMIT = "0" * 39 + "1"
RESOLVE = re.compile(r"/(?P<repo>[^/]+/[^/]+)/resolve/(?P<revision>[^/]+)/(?P<path>.+)")
ABOUT = re.compile(
    r"/api/models/(?P<repo>[^/]+/[^/]+?)(?P<tree>/tree/[^/]+)?(/revision/(?P<revision>[^/]+))?"
)


@dataclass
class ServedFile:
    """A file and what the hub says of it.

    announced: the digest that the hub states. ranges: the first byte that each download asked for.
    """

    content: bytes
    large: bool
    announced: str = ""
    ranges: list[int] = field(default_factory=list)

    def __post_init__(self) -> None:
        git = hashlib.sha1(b"blob %d\0" % len(self.content) + self.content)
        right = hashlib.sha256(self.content) if self.large else git
        self.announced = self.announced or right.hexdigest()

    def entry(self, path: str) -> dict[str, Any]:
        """As the hub lists it."""
        size = len(self.content)
        about: dict[str, Any] = {"type": "file", "path": path, "rfilename": path, "size": size}
        about["oid"] = about["blobId"] = "f" * 40 if self.large else self.announced
        if self.large:
            sha256 = {"oid": self.announced, "sha256": self.announced}
            about["lfs"] = {**sha256, "size": size, "pointerSize": 134}
        return about


@dataclass
class LocalHub:
    """The models of the hub by name. gated: those that need an account.

    commits: the newest of each model that has more than one; former: by name and commit.
    """

    url: str = ""
    models: dict[str, dict[str, ServedFile]] = field(default_factory=dict)
    licences: dict[str, str] = field(default_factory=dict)
    gated: set[str] = field(default_factory=set)
    down: bool = False
    commits: dict[str, str] = field(default_factory=dict)
    former: dict[tuple[str, str], dict[str, ServedFile]] = field(default_factory=dict)

    def add(self, repo: str, folder: Path, licence: str = "apache-2.0") -> None:
        """Serve the files of a folder under this name."""
        self.licences[repo] = licence
        self.models[repo] = {
            str(path.relative_to(folder)): ServedFile(
                path.read_bytes(), large=path.suffix == ".safetensors"
            )
            for path in sorted(folder.rglob("*"))
            if path.is_file()
        }

    def push(self, repo: str, folder: Path, commit: str) -> None:
        """Let a model have a newer version."""
        self.former[repo, self.commits.get(repo, COMMIT)] = self.models[repo]
        self.add(repo, folder)
        self.commits[repo] = commit

    def version(self, repo: str, revision: str) -> tuple[str, dict[str, ServedFile]]:
        """Commit and files of a branch or a commit."""
        if (repo, revision) in self.former:
            return revision, self.former[repo, revision]
        return self.commits.get(repo, COMMIT), self.models[repo]

    def about(self, repo: str, revision: str, tree: bool) -> Any:
        """The answer to a question about a model."""
        commit, files = self.version(repo, revision)
        entries = [file.entry(path) for path, file in files.items()]
        card = {"license": self.licences[repo]}
        return (
            entries if tree else {"id": repo, "sha": commit, "siblings": entries, "cardData": card}
        )


def handler_of(hub: LocalHub) -> type[BaseHTTPRequestHandler]:
    """The requests that the hub's client makes."""

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_GET(self) -> None:
            path = self.path.partition("?")[0]
            if hub.down:
                self.close_connection = True
            elif asked := RESOLVE.fullmatch(path):
                self._file(asked["repo"], asked["revision"], asked["path"])
            elif (asked := ABOUT.fullmatch(path)) and asked["repo"] in hub.models:
                if asked["repo"] in hub.gated:
                    self._refuse()
                else:
                    revision = asked["revision"] or (asked["tree"] or "").rpartition("/")[2]
                    answer = hub.about(asked["repo"], revision, bool(asked["tree"]))
                    self._send(200, json.dumps(answer).encode(), {})
            else:
                self._send(404, b"{}", {"X-Error-Code": "RepoNotFound"})

        do_HEAD = do_GET  # noqa: N815

        def _file(self, repo: str, revision: str, path: str) -> None:
            commit, files = hub.version(repo, revision)
            file = files.get(path)
            if file is None:
                self._send(404, b"", {"X-Error-Code": "EntryNotFound"})
                return
            asked = re.match(r"bytes=(\d+)-(\d*)", self.headers.get("Range", ""))
            begin = int(asked[1]) if asked else 0
            end = int(asked[2]) + 1 if asked and asked[2] else len(file.content)
            headers = {
                "ETag": f'"{file.announced}"',
                "X-Repo-Commit": commit,
                "Accept-Ranges": "bytes",
                **({"X-Linked-Etag": f'"{file.announced}"'} if file.large else {}),
            }
            status = 206 if asked else 200
            body = file.content[begin:end]
            if self.command == "GET" and not (asked and asked[2]):  # not the header alone
                file.ranges.append(begin)
            self._send(status, body, headers)

        def _refuse(self) -> None:
            self._send(403, b"{}", {"X-Error-Code": "GatedRepo", "X-Error-Message": "gated"})

        def _send(self, status: int, body: bytes, headers: dict[str, str]) -> None:
            self._head(status, len(body), headers)
            if self.command == "GET":
                self.wfile.write(body)

        def _head(self, status: int, size: int, headers: dict[str, str]) -> None:
            self.send_response(status)
            for name, value in {**headers, "Content-Length": str(size)}.items():
                self.send_header(name, value)
            self.end_headers()

        def log_message(self, format: str, *_: Any) -> None:
            """Say nothing."""

    return Handler


@contextmanager
def serve_hub() -> Iterator[LocalHub]:
    """A hub without models on a free port of loopback."""
    hub = LocalHub()
    server = ThreadingHTTPServer(("127.0.0.1", 0), handler_of(hub))
    server.daemon_threads = True
    thread = threading.Thread(target=server.serve_forever, args=(POLL_S,), daemon=True)
    thread.start()
    hub.url = f"http://127.0.0.1:{server.server_port}"
    try:
        yield hub
    finally:
        server.shutdown()
        server.server_close()


def use_hub(hub: LocalHub, cache: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the hub's client in this process ask this hub, with an empty cache."""
    from huggingface_hub import constants

    monkeypatch.setattr(constants, "ENDPOINT", hub.url)
    files = hub.url + "/{repo_id}/resolve/{revision}/{filename}"
    monkeypatch.setattr(constants, "HUGGINGFACE_CO_URL_TEMPLATE", files)
    monkeypatch.setattr(constants, "HF_HUB_CACHE", str(cache))
    monkeypatch.setattr(constants, "HF_HUB_OFFLINE", False)
    monkeypatch.setattr(constants, "HF_HUB_DISABLE_TELEMETRY", True)
