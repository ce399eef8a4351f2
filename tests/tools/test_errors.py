"""The sentence and the exit code of an error."""

from __future__ import annotations

import pytest

from onemap_tools.errors import (
    EXIT_FAILED,
    EXIT_INTERRUPTED,
    EXIT_USAGE_ERROR,
    CliError,
    requires_extra,
    to_cli_error,
)


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
    error = to_cli_error(cause)
    assert (str(error), error.exit_code) == (sentence, exit_code)


def test_the_document_of_an_error_is_kept() -> None:
    error = CliError("failed", document={"seed": 1})
    assert to_cli_error(error) is error
    assert error.document == {"seed": 1}


def test_a_missing_package_is_reported_with_its_extra() -> None:
    sentence = "The mapper needs the package 'torch': pip install 'onemap[mapper]'"
    with pytest.raises(CliError) as error, requires_extra("mapper", "The mapper"):
        raise ModuleNotFoundError("No module named 'torch'", name="torch.nn")
    assert (str(error.value), error.value.exit_code) == (sentence, EXIT_USAGE_ERROR)


def test_a_missing_module_of_ours_is_a_bug() -> None:
    with pytest.raises(ModuleNotFoundError), requires_extra("mapper", "The mapper"):
        raise ModuleNotFoundError("No module named 'onemap_mapper.x'", name="onemap_mapper.x")
