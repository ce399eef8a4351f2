"""Which exit code an exception ends a command with."""

from __future__ import annotations

import pytest

from onemap_tools.errors import EXIT_FAILED, EXIT_INTERRUPTED, EXIT_USAGE_ERROR, CliError
from onemap_tools.errors import to_cli_error as convert


@pytest.mark.parametrize(
    ("cause", "sentence", "exit_code"),
    [
        (KeyboardInterrupt(), "Stopped.", EXIT_INTERRUPTED),
        (ValueError("no such key"), "no such key", EXIT_USAGE_ERROR),
        (CliError("not found"), "not found", EXIT_FAILED),
    ],
)
def test_every_cause_has_a_sentence_and_a_code(
    cause: BaseException, sentence: str, exit_code: int
) -> None:
    error = convert(cause)
    assert (str(error), error.exit_code) == (sentence, exit_code)


def test_the_document_of_an_error_is_kept() -> None:
    error = CliError("failed", document={"seed": 1})
    assert convert(error) is error
    assert error.document == {"seed": 1}
