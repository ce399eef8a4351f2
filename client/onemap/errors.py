"""What can go wrong; the text of every error is one sentence that says what to do."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

GATEWAY_ERRORS = (502, 503, 504)  # a service, or the gateway behind a proxy, is away for a while


class OneMapError(Exception):
    """A request that was refused or failed.

    status: the HTTP status, 0 if there was no reply.
    document: the problem details (RFC 9457) with all their members; empty without any.
    """

    def __init__(
        self, detail: str, *, status: int = 0, document: Mapping[str, Any] | None = None
    ) -> None:
        super().__init__(detail)
        self.detail = detail
        self.status = status
        self.document: Mapping[str, Any] = document or {}

    @property
    def type(self) -> str:
        """Which problem, such as ``/docs#problem-unknown_word``; empty if unknown."""
        return str(self.document.get("type", ""))

    @property
    def title(self) -> str:
        """The problem in a few words; empty if unknown."""
        return str(self.document.get("title", ""))

    @property
    def hints(self) -> dict[str, tuple[str, ...]]:
        """For each word that the encoder does not know, the known words nearest to it."""
        words = self.document.get("words", ())
        return {str(each["word"]): tuple(each.get("did_you_mean", ())) for each in words}

    @property
    def search_id(self) -> str:
        """The search that runs already, which refused this one (409); else empty."""
        return str(self.document.get("search_id", ""))

    @property
    def temporary(self) -> bool:
        """Whether the same request may succeed a little later."""
        return self.status in GATEWAY_ERRORS


class Unreachable(OneMapError):
    """The gateway at ``url`` did not answer.

    ``timed_out``: something accepted the connection, but did not answer in time.
    """

    def __init__(self, detail: str, url: str, *, timed_out: bool = False) -> None:
        super().__init__(detail)
        self.url = url
        self.timed_out = timed_out

    @property
    def temporary(self) -> bool:
        """Whether the same request may succeed a little later."""
        return True


class InvalidSetting(OneMapError, ValueError):
    """An address, a token, a place or the name of a map that cannot be used."""


def problem_error(status: int, document: object, otherwise: str) -> OneMapError:
    """The error for a reply with this body; ``otherwise`` is said if it has no ``detail``."""
    problem = document if isinstance(document, dict) else {}
    detail = problem.get("detail")
    sentence = detail if isinstance(detail, str) and detail else otherwise
    return OneMapError(sentence, status=status, document=problem)
