"""Known models on a generated cache; nothing is downloaded."""

from __future__ import annotations

import io
from pathlib import Path

import pytest

from onemap_perception import model_store
from onemap_tools.cli.known_models import describe, describe_reports, inventory, verify
from onemap_tools.cli.terminal import plain_console
from onemap_tools.errors import EXIT_FAILED, EXIT_USAGE_ERROR, CliError
from tests.perception.hub_cache import REPO, put_in_cache, use_cache

pytest.importorskip("huggingface_hub", reason="needs huggingface_hub (extra openclip)")


@pytest.fixture
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    use_cache(tmp_path, monkeypatch)
    return tmp_path


def test_every_known_model_is_in_the_inventory(cache: Path) -> None:
    folder = put_in_cache(cache)
    entries = {entry.model.repo: entry for entry in inventory()}
    assert set(entries) == {model.repo for model in model_store.KNOWN_MODELS}
    assert entries[REPO].folder == str(folder)
    assert entries[REPO].bytes_here > 0
    assert {entry.folder for repo, entry in entries.items() if repo != REPO} == {""}


def test_models_are_printed_with_their_folder_or_size(cache: Path) -> None:
    folder = put_in_cache(cache)
    out = io.StringIO()
    describe(inventory(), plain_console(file=out))
    text = "".join(out.getvalue().split())  # long paths are wrapped
    assert f"MBin{folder}" in text
    assert text.count("notfetched") == len(model_store.KNOWN_MODELS) - 1


def test_an_absent_model_cannot_be_verified(cache: Path) -> None:
    assert verify("") == []
    with pytest.raises(CliError, match=f"onemap models fetch {REPO}") as absent:
        verify(REPO)
    assert absent.value.exit_code == EXIT_FAILED
    with pytest.raises(CliError) as unknown:
        verify("nobody/nothing")
    assert unknown.value.exit_code == EXIT_USAGE_ERROR


def test_damaged_files_are_printed(cache: Path) -> None:
    folder = put_in_cache(cache)
    assert verify(REPO) == [{"repo": REPO, "folder": str(folder), "damaged": []}]
    (folder / "model.safetensors").resolve().write_bytes(b"other")
    out = io.StringIO()
    describe_reports(verify(""), plain_console(file=out))
    text = " ".join(out.getvalue().split())
    assert text.startswith(f"{REPO}: damaged: model.safetensors; delete ")
