"""Reads episode files: one ``.json.gz``, a split with its ``content`` folder, a folder of scenes.

A file that holds more than the limits below is refused before it fills the memory.
"""

from __future__ import annotations

import gzip
import io
import json
import zlib
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Any

from onemap_tools.bench.habitat.episode_layout import (
    EpisodeFile,
    GoalsOfScene,
    HabitatEpisode,
    goals_of,
    parse_episodes,
)

SUFFIX = ".json.gz"
MAX_FILE_BYTES = 256 * 2**20  # compressed; all of objectnav_hm3d_v2 together has 260 MB
MAX_JSON_BYTES = 2**30  # of one file, unpacked: a scene's view points are repetitive text
MAX_FILES = 2000  # of one folder: HM3D has 1000 scenes


@dataclass(frozen=True, slots=True)
class EpisodeSet:
    """Episodes of all files in the order of their names, indices counting through, and goals."""

    episodes: tuple[HabitatEpisode, ...]
    goals: GoalsOfScene


def read_episodes(path: Path, goals: Path | None, count: int | None) -> EpisodeSet:
    """The first ``count`` episodes of ``path``, or all, with the goals of their objects.

    goals: ObjectNav episodes of the same scenes, for episodes without goals of their own. Raises
    ValueError with one sentence.
    """
    episodes: list[HabitatEpisode] = []
    known: GoalsOfScene = {}
    for file in episode_files(path):
        if count is not None and len(episodes) >= count:
            break
        content = read_file(file)
        known |= content.goals
        episodes += [
            replace(each, index=len(episodes) + n) for n, each in enumerate(content.episodes)
        ]
    episodes = episodes[:count]
    if not episodes:
        raise ValueError(f"{path} holds no episode")
    if goals is not None:
        known |= _goals_for(episodes, goals)
    for episode in episodes:
        for name in episode.objects:
            goals_of(known, episode.scene, name)
    return EpisodeSet(tuple(episodes), known)


def read_episode(path: Path, index: int) -> HabitatEpisode:
    """The episode of an index, for which no goals need be known; ValueError with one sentence."""
    before = 0
    for file in episode_files(path):
        episodes = read_file(file).episodes
        if index < before + len(episodes):
            return replace(episodes[index - before], index=index)
        before += len(episodes)
    raise ValueError(f"{path} holds {before} episodes: there is no number {index}, they begin at 0")


def _goals_for(episodes: Iterable[HabitatEpisode], path: Path) -> GoalsOfScene:
    """Goals of the episodes' scenes; files that are named after other scenes are not opened."""
    wanted = {PurePosixPath(episode.scene).name.split(".")[0] for episode in episodes}
    files = episode_files(path)
    named = [file for file in files if file.name.removesuffix(SUFFIX) in wanted]
    found: GoalsOfScene = {}
    for file in named or files:
        found |= read_file(file).goals
    return found


def episode_files(path: Path) -> list[Path]:
    """The files of a file, of a split or of a folder, sorted by name without case.

    A split is ``val.json.gz`` or its folder, with the episodes in ``content`` beside the file. In
    a folder of scenes each has a folder of its own, ``00800-NAME/NAME_episodes.json.gz``.
    """
    content = (path.parent if path.is_file() else path) / "content"
    if path.is_file() and not (content.is_dir() and _is_index(path)):
        return [path]
    folder = content if content.is_dir() else path
    if not folder.is_dir():
        raise ValueError(f"there is no file or folder {path}")
    found = [*folder.glob("*" + SUFFIX), *folder.glob("*/*_episodes" + SUFFIX)]
    if not 0 < len(found) <= MAX_FILES:
        raise ValueError(f"{folder} holds {len(found)} files *{SUFFIX}; 1 to {MAX_FILES} are read")
    return sorted(found, key=lambda file: str(file.relative_to(folder)).casefold())


def _is_index(path: Path) -> bool:
    """Whether a file beside ``content`` only stands for its folder."""
    return not read_file(path).episodes


def read_file(path: Path) -> EpisodeFile:
    """The episodes and goals of one file; ValueError with one sentence."""
    return parse_episodes(_json(path), str(path))


def _json(path: Path) -> Any:
    size = path.stat().st_size
    if size > MAX_FILE_BYTES:
        raise ValueError(f"{path} has {size} bytes; at most {MAX_FILE_BYTES} are read")
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(path.read_bytes())) as stream:
            text = stream.read(MAX_JSON_BYTES + 1)
    except (OSError, EOFError, zlib.error) as problem:
        raise ValueError(f"{path} is not readable as gzip: {problem}") from problem
    if len(text) > MAX_JSON_BYTES:
        raise ValueError(f"{path} unpacks to more than {MAX_JSON_BYTES} bytes: it is not read")
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as problem:
        raise ValueError(f"{path} is not readable as JSON: {problem}") from problem
