"""Layout of episode files, as parsed JSON: Habitat's ObjectNav and the paper's sequences.

ObjectNav (HM3D v1 and v2): ``episodes`` with one ``object_category`` each, and
``goals_by_category`` with the instances of a category in a scene and the places from which they
can be seen. The paper's multi-object episodes have a list ``object_goals`` instead and no goals:
those come from the ObjectNav files of the same scenes. Keys that are not named here are ignored.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from onemap_shared.geometry import F64
from onemap_tools.bench.habitat.coordinates import Point, Quaternion

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
    """What one file holds; the indices of its episodes count from 0."""

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
