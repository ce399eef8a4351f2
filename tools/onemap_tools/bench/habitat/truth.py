"""Ground truth of an episode: what counts as found, and how long the shortest path is.

Two rules. The paper's: the robot stopped less than 1.5 m, in a straight line seen from above, from
the box of an instance; what an instance is follows the released evaluation, by semantic ids and by
the annotators' names. Habitat's ObjectNav: at most 0.1 m of way from one of the episode file's view
points. Shortest paths lead to the nearest view point under both, as the files' own do.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from math import inf

from onemap_shared.messages import ObjectResult
from onemap_simulator.ground_truth import SUCCESS_RADIUS_M
from onemap_tools.bench.habitat.choices import SuccessRule
from onemap_tools.bench.habitat.coordinates import Point
from onemap_tools.bench.habitat.episode_layout import CategoryGoals
from onemap_tools.bench.habitat.world import AnnotatedBox, World
from onemap_tools.demo.summary import ObjectSummary

# Annotators' names, or parts of them, that the released evaluation counts beside a category's own.
ALSO_NAMED = {"plant": "flower", "sofa": "couch"}


@dataclass(frozen=True, slots=True)
class SearchPlaces:
    """Where the search for an object began, where it ended and what it claimed to have found,
    Habitat's coordinates; None: no claim."""

    start: Point
    end: Point
    claimed: Point | None


@dataclass(frozen=True, slots=True)
class CategoryTruth:
    """Ground truth of one category in the open scene."""

    category: str
    goals: CategoryGoals
    instances: tuple[AnnotatedBox, ...]
    others: tuple[AnnotatedBox, ...]
    rule: SuccessRule

    @classmethod
    def of(
        cls,
        category: str,
        goals: CategoryGoals,
        boxes: Iterable[AnnotatedBox],
        rule: SuccessRule,
    ) -> CategoryTruth:
        """ValueError if the paper's rule has no box of an instance to measure from."""
        instances: list[AnnotatedBox] = []
        others: list[AnnotatedBox] = []
        for box in boxes:
            (instances if is_instance(box, category, goals) else others).append(box)
        if rule is SuccessRule.PAPER and not instances:
            raise ValueError(
                f"no annotated object of the scene is a {category!r}: the paper's rule needs the "
                "semantic annotations of HM3D; without them choose --success habitat"
            )
        return cls(category, goals, tuple(instances), tuple(others), rule)

    @property
    def semantic_ids(self) -> frozenset[int]:
        """Of all instances."""
        return self.goals.object_ids | {box.semantic_id for box in self.instances}

    def distance_m(self, place: Point) -> float:
        """Straight line, seen from above, to the box of the nearest instance."""
        return min((horizontal_m(box, place) for box in self.instances), default=inf)

    def judged(self, result: ObjectResult, places: SearchPlaces, world: World) -> ObjectSummary:
        """The result beside the truth; ``goal_distance_m`` is 0 where the rule counts it."""
        near_m, path_m = (
            self.distance_m(places.end),
            world.path_m(places.end, self.goals.view_points),
        )
        reached = near_m < SUCCESS_RADIUS_M
        if self.rule is SuccessRule.PAPER:
            path_m = 0.0 if reached else max(path_m, near_m)
        return ObjectSummary(
            name=result.name,
            outcome=result.outcome.value,
            reason=result.reason,
            position_m=result.position_m,
            time_s=result.duration_s,
            path_length_m=result.path_length_m,
            shortest_path_m=world.path_m(places.start, self.goals.view_points),
            true_distance_m=near_m,
            goal_distance_m=path_m,
            nearest=self._nearest(result.name, places.claimed),
        )

    def _nearest(self, name: str, claimed: Point | None) -> str:
        """The name itself if the claim is near an instance, else that of the nearest box."""
        if claimed is None:
            return ""
        if self.distance_m(claimed) < SUCCESS_RADIUS_M:
            return name
        ranked = sorted(self.others, key=lambda box: horizontal_m(box, claimed))
        return ranked[0].category if ranked else ""


def is_instance(box: AnnotatedBox, category: str, goals: CategoryGoals) -> bool:
    """Whether an annotated object counts as of the category.

    By the ids of the episode file, or by its name as the released evaluation compares: one name
    is part of the other, or it holds the other word for a plant or a sofa.
    """
    if box.semantic_id in goals.object_ids:
        return True
    name = box.category.strip().lower()
    if not name:
        return False
    other = ALSO_NAMED.get(category)
    return name in category or category in name or (other is not None and other in name)


def horizontal_m(box: AnnotatedBox, place: Point) -> float:
    """Distance of a place from a box, seen from above: Habitat's x and z; 0 inside."""
    gaps = [max(box.lower[k] - place[k], 0.0, place[k] - box.upper[k]) for k in (0, 2)]
    return float((gaps[0] ** 2 + gaps[1] ** 2) ** 0.5)
