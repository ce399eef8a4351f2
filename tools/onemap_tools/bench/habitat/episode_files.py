"""Reads episode files: Habitat's ObjectNav and the paper's sequences of objects.

One ``.json.gz``, a split with its ``content`` folder, or a folder of scenes. ObjectNav (HM3D v1 and
v2): ``episodes`` with one ``object_category`` each, and ``goals_by_category`` with the instances of
a category in a scene and the places from which they can be seen. The paper's multi-object episodes
have a list ``object_goals`` instead and no goals: those come from the ObjectNav files of the same
scenes. Other keys are ignored; a file that holds more than the limits below is refused before it
fills the memory.
"""

from __future__ import annotations

import gzip
import io
import json
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path, PurePosixPath
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from onemap_shared.geometry import F64
from onemap_tools.bench.habitat.world import Point, Quaternion

SUFFIX = ".json.gz"
MAX_FILE_BYTES = 256 * 2**20  # compressed; all of objectnav_hm3d_v2 together has 260 MB
MAX_JSON_BYTES = 2**30  # of one file, unpacked: a scene's view points are repetitive text
MAX_FILES = 2000  # of one folder: HM3D has 1000 scenes
MAX_EPISODES = 100_000  # fifty times HM3D's validation split
MAX_OBJECTS = 20  # of a sequence
MAX_ROTATION_ERROR = 0.01  # of a quaternion's length: what rounding in JSON leaves
SCENE_ROOT = "data/scene_datasets/"  # that some files write before the names of scenes
ANNOTATIONS = "hm3d_annotated_basis.scene_dataset_config.json"  # beside HM3D's splits

Name = Annotated[str, Field(min_length=1, max_length=500)]
Coordinate = Annotated[float, Field(ge=-1e5, le=1e5)]  # metres; 100 km is no house
Position = tuple[Coordinate, Coordinate, Coordinate]


@dataclass(frozen=True, slots=True)
class HabitatEpisode:
    """A start, Habitat's coordinates, and the categories to find one after the other.

    scene, scene_config: files of the scene and of its annotations, relative to the scenes' folder.
    """

    index: int
    scene: str
    scene_config: str
    start: Point
    rotation: Quaternion
    objects: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CategoryGoals:
    """Instances of a category in a scene. object_ids: their semantic ids; view_points (N, 3): where
    the agent can stand to see one, Habitat's coordinates."""

    object_ids: frozenset[int]
    view_points: F64


GoalsOfScene = dict[tuple[str, str], CategoryGoals]  # by file name of the scene, and category


@dataclass(frozen=True, slots=True)
class EpisodeFile:
    """Episodes and goals of one file or of several; the indices of its episodes count from 0."""

    episodes: tuple[HabitatEpisode, ...]
    goals: GoalsOfScene


class _Layout(BaseModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class _AgentState(_Layout):
    position: Position


class _ViewPoint(_Layout):
    agent_state: _AgentState


class _Goal(_Layout):
    object_id: int
    view_points: list[_ViewPoint] = []


class _Episode(_Layout):
    scene_id: Name
    scene_dataset_config: str = ""
    start_position: Position
    start_rotation: tuple[Coordinate, Coordinate, Coordinate, Coordinate]
    object_category: Name | None = None
    object_goals: Annotated[list[Name], Field(max_length=MAX_OBJECTS)] = []


class _File(_Layout):
    episodes: Annotated[list[_Episode], Field(max_length=MAX_EPISODES)]
    goals_by_category: dict[str, list[_Goal]] = {}


def parse_episodes(document: Any, where: str) -> EpisodeFile:
    """The episodes and goals of a document; ``where`` begins the sentence of a ValueError."""
    try:
        layout = _File.model_validate(document)
        episodes = [_episode(index, each) for index, each in enumerate(layout.episodes)]
    except ValidationError as problem:
        first = problem.errors()[0]
        place = ".".join(map(str, first["loc"])) or "the document"
        raise ValueError(
            f"{where}: {place}: {first['msg']}; this is no file of ObjectNav or multi-object "
            "episodes"
        ) from problem
    except ValueError as problem:
        raise ValueError(f"{where}: {problem}") from problem
    goals = {_key(name): _goals(found) for name, found in layout.goals_by_category.items()}
    return EpisodeFile(tuple(episodes), goals)


def goals_of(
    goals: Mapping[tuple[str, str], CategoryGoals], scene: str, name: str
) -> CategoryGoals:
    """The goals of a category in the scene of an episode; ValueError if there is no place."""
    found = goals.get((PurePosixPath(scene).name, name))
    if found is None or not len(found.view_points):
        raise ValueError(
            f"there is no view point of {name!r} in {PurePosixPath(scene).name}: give the "
            "ObjectNav episodes of the same scenes with --goals"
        )
    return found


def _episode(index: int, layout: _Episode) -> HabitatEpisode:
    single = [layout.object_category] if layout.object_category else []
    objects = tuple(layout.object_goals or single)
    if not objects:
        raise ValueError(f"episode {index} has neither object_category nor object_goals")
    scene = _inside(layout.scene_id, index)
    config = layout.scene_dataset_config
    return HabitatEpisode(
        index,
        scene,
        _inside(config, index) if "annotated" in config else _beside(scene),
        layout.start_position,
        _unit(layout.start_rotation, index),
        objects,
    )


def _inside(name: str, index: int) -> str:
    """The path of a scene's file below the folder of all scenes."""
    path = PurePosixPath(name.removeprefix("./").removeprefix(SCENE_ROOT))
    if path.is_absolute() or ".." in path.parts or not path.parts:
        raise ValueError(
            f"episode {index} names {name!r}: a scene lies below the folder of scenes, and its "
            "path neither begins with '/' nor holds '..'"
        )
    return str(path)


def _beside(scene: str) -> str:
    """The annotations of a scene whose episode names none, in the first folder of its path: the
    verdict needs them, and files differ in which description of the scenes they name."""
    return str(PurePosixPath(scene).parts[0] / PurePosixPath(ANNOTATIONS))


def _unit(rotation: Quaternion, index: int) -> Quaternion:
    length = float(np.linalg.norm(rotation))
    if abs(length - 1) > MAX_ROTATION_ERROR:
        raise ValueError(
            f"episode {index} has a start_rotation of length {length:.3g} instead of 1"
        )
    x, y, z, w = (part / length for part in rotation)
    return x, y, z, w


def _key(name: str) -> tuple[str, str]:
    """Scene and category of a key like ``TEEsavR23oF.basis.glb_chair``."""
    scene, separator, category = name.partition(".glb_")
    return (scene + ".glb", category) if separator else (name, "")


def _goals(found: list[_Goal]) -> CategoryGoals:
    places = [view.agent_state.position for goal in found for view in goal.view_points]
    return CategoryGoals(
        frozenset(goal.object_id for goal in found), np.array(places, np.float64).reshape(-1, 3)
    )


def read_episodes(path: Path, goals: Path | None, count: int | None) -> EpisodeFile:
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
    return EpisodeFile(tuple(episodes), known)


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
