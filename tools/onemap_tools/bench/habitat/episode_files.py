"""Reads episode files: Habitat's ObjectNav and the paper's sequences of objects.

One ``.json.gz``, a split's folder with its ``content``, or a folder with one of each scene.
ObjectNav (HM3D v1 and v2): ``episodes`` with one ``object_category`` each, and
``goals_by_category`` with the instances of a category in a scene and the places from which they
can be seen. The paper's episodes have a list ``object_goals`` and no goals: those come from the
ObjectNav files of the same scenes.
"""

from __future__ import annotations

import gzip
import json
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Annotated, Any

import numpy as np
from pydantic import (
    AfterValidator,
    AliasChoices,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
)

from onemap_shared.geometry import F64
from onemap_tools.bench.habitat.world import Quaternion

SUFFIX = ".json.gz"
MAX_ROTATION_ERROR = 0.01  # of a quaternion's length: what rounding in JSON leaves
SCENE_ROOT = "data/scene_datasets/"  # that some files write before the names of scenes
ANNOTATIONS = "hm3d_annotated_basis.scene_dataset_config.json"  # beside HM3D's splits

Position = tuple[float, float, float]


def _below(name: str) -> str:
    """The path of a scene's file below the folder of all scenes."""
    return name.removeprefix("./").removeprefix(SCENE_ROOT)


def _unit(rotation: Quaternion) -> Quaternion:
    length = float(np.linalg.norm(rotation))
    if abs(length - 1) > MAX_ROTATION_ERROR:
        raise ValueError(f"a rotation has length {length:.3g} instead of 1")
    x, y, z, w = (part / length for part in rotation)
    return x, y, z, w


class _Layout(BaseModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False, populate_by_name=True)


class HabitatEpisode(_Layout):
    """A start, Habitat's coordinates, and the categories to find one after the other.

    scene, scene_config: files of the scene and of its annotations, relative to the scenes' folder.
    """

    index: int = 0
    scene: Annotated[str, AfterValidator(_below)] = Field(alias="scene_id")
    scene_config: str = Field(default="", alias="scene_dataset_config")
    start: Position = Field(alias="start_position")
    rotation: Annotated[Quaternion, AfterValidator(_unit)] = Field(alias="start_rotation")
    objects: Annotated[
        tuple[Annotated[str, Field(min_length=1)], ...],
        BeforeValidator(lambda named: [named] if isinstance(named, str) else named),
        Field(min_length=1),
    ] = Field(validation_alias=AliasChoices("object_goals", "object_category"))

    @property
    def annotations(self) -> str:
        """``scene_config`` where it holds them: files differ in which description they name."""
        if "annotated" in self.scene_config:
            return _below(self.scene_config)
        return f"{PurePosixPath(self.scene).parts[0]}/{ANNOTATIONS}"


@dataclass(frozen=True, slots=True)
class CategoryGoals:
    """Instances of a category in a scene. object_ids: their semantic ids; view_points (N, 3): where
    the agent can stand to see one, Habitat's coordinates."""

    object_ids: frozenset[int]
    view_points: F64


GoalsOfScene = Mapping[tuple[str, str], CategoryGoals]  # by file name of the scene, and category


@dataclass(frozen=True, slots=True)
class EpisodeFile:
    """Episodes and goals of one file or of several; the indices of its episodes count from 0."""

    episodes: tuple[HabitatEpisode, ...]
    goals: GoalsOfScene


class _AgentState(_Layout):
    position: Position


class _ViewPoint(_Layout):
    agent_state: _AgentState


class _Goal(_Layout):
    object_id: int
    view_points: list[_ViewPoint] = []


class _File(_Layout):
    episodes: list[HabitatEpisode]
    goals_by_category: dict[str, list[_Goal]] = {}


def read_episodes(path: Path, goals: Path | None, count: int | None) -> EpisodeFile:
    """The first ``count`` episodes of ``path``, or all, with the goals of their objects.

    goals: ObjectNav episodes of the same scenes, for episodes without goals of their own. Raises
    ValueError with one sentence.
    """
    episodes: list[HabitatEpisode] = []
    known: dict[tuple[str, str], CategoryGoals] = {}
    for file in episode_files(path):
        if count is not None and len(episodes) >= count:
            break
        content = parse_episodes(_json(file), str(file))
        known |= content.goals
        episodes += content.episodes
    episodes = [each.model_copy(update={"index": n}) for n, each in enumerate(episodes)]
    if not (episodes := episodes[:count]):
        raise ValueError(f"{path} holds no episode; of a split give the folder")
    if goals is not None:
        scenes = {PurePosixPath(episode.scene).name.split(".")[0] for episode in episodes}
        files = episode_files(goals)
        named = [file for file in files if file.name.removesuffix(SUFFIX) in scenes]
        for file in named or files:
            known |= parse_episodes(_json(file), str(file)).goals
    for episode in episodes:
        for name in episode.objects:
            goals_of(known, episode.scene, name)
    return EpisodeFile(tuple(episodes), known)


def episode_files(path: Path) -> list[Path]:
    """A file, or those of a folder sorted by name without case: of ``content`` if it has one.

    In a folder of scenes each has a folder of its own, ``00800-NAME/NAME_episodes.json.gz``.
    """
    if path.is_file():
        return [path]
    folder = path / "content" if (path / "content").is_dir() else path
    if not folder.is_dir():
        raise ValueError(f"there is no file or folder {path}")
    found = [*folder.glob("*" + SUFFIX), *folder.glob("*/*_episodes" + SUFFIX)]
    if not found:
        raise ValueError(f"{folder} holds no files *{SUFFIX}")
    return sorted(found, key=lambda file: str(file.relative_to(folder)).casefold())


def _json(path: Path) -> Any:
    try:
        with gzip.open(path) as stream:
            return json.load(stream)
    except (OSError, EOFError, zlib.error, ValueError) as problem:
        raise ValueError(f"{path} is not readable as JSON in gzip: {problem}") from problem


def parse_episodes(document: Any, where: str) -> EpisodeFile:
    """The episodes and goals of a document; ``where`` begins the sentence of a ValueError."""
    try:
        layout = _File.model_validate(document)
    except ValidationError as problem:
        first = problem.errors()[0]
        place = ".".join(map(str, first["loc"])) or "the document"
        raise ValueError(
            f"{where}: {place}: {first['msg']}; this is no file of ObjectNav or multi-object "
            "episodes"
        ) from problem
    goals = {}
    for name, found in layout.goals_by_category.items():
        scene, separator, category = name.partition(".glb_")  # as TEEsavR23oF.basis.glb_chair
        places = [view.agent_state.position for goal in found for view in goal.view_points]
        goals[(scene + ".glb", category) if separator else (name, "")] = CategoryGoals(
            frozenset(goal.object_id for goal in found),
            np.array(places, np.float64).reshape(-1, 3),
        )
    return EpisodeFile(tuple(layout.episodes), goals)


def goals_of(goals: GoalsOfScene, scene: str, name: str) -> CategoryGoals:
    """The goals of a category in the scene of an episode; ValueError if there is no place."""
    found = goals.get((PurePosixPath(scene).name, name))
    if found is None or not len(found.view_points):
        raise ValueError(
            f"there is no view point of {name!r} in {PurePosixPath(scene).name}: give the "
            "ObjectNav episodes of the same scenes with --goals"
        )
    return found
