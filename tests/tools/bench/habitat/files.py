"""Small episode files in the layouts of Habitat's ObjectNav and of the paper's sequences."""

from __future__ import annotations

import gzip
import json
from pathlib import Path
from typing import Any

SCENE_V1 = "hm3d/val/00800-TEEsavR23oF/TEEsavR23oF.basis.glb"
SCENE_V2 = "hm3d_v0.2/val/00801-HaxA7YrQdEC/HaxA7YrQdEC.basis.glb"
FACING_LEFT = [0.0, 0.70710678, 0.0, 0.70710678]  # a quarter turn about Habitat's y


def write(path: Path, document: Any) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(gzip.compress(json.dumps(document).encode()))
    return path


def goal(category: str, object_id: int, *places: list[float]) -> dict[str, Any]:
    pose = {"rotation": [0, 0, 0, 1]}
    return {
        "position": [0.0, 0.4, 0.0],
        "object_id": object_id,
        "object_name": f"{category}_{object_id}",
        "object_category": category,
        "room_id": None,
        "view_points": [{"agent_state": {"position": at, **pose}, "iou": 0.1} for at in places],
    }


def objectnav(scene: str, *categories: str, config: str = "") -> dict[str, Any]:
    """A file of ``content``: an episode and two instances per category."""
    name = scene.rpartition("/")[2]
    episode = {
        "episode_id": "0",
        "scene_id": scene,
        "scene_dataset_config": config,
        "start_position": [1.0, 0.2, -2.0],
        "start_rotation": FACING_LEFT,
        "info": {"geodesic_distance": 3.5, "euclidean_distance": 3.0, "closest_goal_object_id": 7},
        "goals": [],
    }
    goals = {
        f"{name}_{category}": [
            goal(category, 7 + i, [2.0, 0.2, -3.0 - i], [2.5, 0.2, -3.0 - i]) for i in range(2)
        ]
        for category in categories
    }
    return {
        "episodes": [{**episode, "object_category": category} for category in categories],
        "goals_by_category": goals,
        "category_to_task_category_id": {name: i for i, name in enumerate(categories)},
    }


def index_file() -> dict[str, Any]:
    """``val.json.gz`` of a split with a file per scene."""
    return {"episodes": [], "category_to_task_category_id": {"chair": 0}}


def multi_object(scene: str, *sequences: list[str]) -> dict[str, Any]:
    """A file of the paper's episodes."""
    return {
        "episodes": [
            {
                "start_position": [1.0, 0.2, -2.0],
                "start_rotation": FACING_LEFT,
                "object_goals": objects,
                "scene_id": scene,
                "floor": 0,
                "best_seq_dists": [[2.0, [2.0, 0.2, -3.0]] for _ in objects],
            }
            for objects in sequences
        ]
    }
