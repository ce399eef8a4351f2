"""Small maps drawn as text, for tests that look at one step only."""

from __future__ import annotations

import numpy as np

from onemap_planner.config import PlannerConfig
from onemap_planner.motion.path import Reach, reach_from
from onemap_planner.world.costmap import Terrain, TerrainRules, build_terrain
from onemap_planner.world.map_view import Belief
from onemap_shared.geometry import F32
from onemap_shared.grid import GridSpec
from onemap_shared.messages import Layer, Occupancy, SearchView

CELL_M = 0.1
NO_PLACES = np.zeros((0, 2))
RULES = PlannerConfig().rules()
POINT_ROBOT = TerrainRules(
    radius_m=0.0,
    margin_m=0.05,
    comfort_m=0.06,
    comfort_weight=0.0,
    escape_radius_m=0.3,
    escape_below_m2=0.02,
)


def drawn(*rows: str, scale: int = 1, similarity: F32 | None = None) -> Belief:
    """A belief from rows of characters; rows run along x, characters along y.

    ``#`` occupied, ``.`` free and explored and searched, ``,`` free and observed only, ``o``
    free, explored, not searched, blank unknown. Each character is ``scale`` cells square.
    """
    letters = np.array([list(row) for row in rows]).repeat(scale, axis=0).repeat(scale, axis=1)
    occupancy = np.full(letters.shape, Occupancy.FREE, np.uint8)
    occupancy[letters == "#"] = Occupancy.OCCUPIED
    occupancy[letters == " "] = Occupancy.UNKNOWN
    observed = letters != " "
    return Belief(
        grid=GridSpec(CELL_M, (0, 0), (letters.shape[0], letters.shape[1])),
        occupancy=occupancy,
        observed=observed,
        explored=observed & (letters != ","),
        searched=observed & ~np.isin(letters, [",", "o"]),
        similarity=(
            np.where(observed, np.float32(0.1), np.float32(np.nan)).astype(np.float32)
            if similarity is None
            else similarity
        ),
        rival=np.full(letters.shape, -np.inf, np.float32),
    )


def terrain_of(
    belief: Belief, robot_xy: tuple[float, float], rules: TerrainRules = POINT_ROBOT
) -> Terrain:
    """The terrain without trail and blocks."""
    return build_terrain(
        belief,
        robot_xy=np.array(robot_xy),
        trail_xy=NO_PLACES,
        blocked_xy=NO_PLACES,
        rules=rules,
    )


def standing(
    belief: Belief, robot_xy: tuple[float, float], rules: TerrainRules = POINT_ROBOT
) -> tuple[Terrain, Reach]:
    """Terrain and ways for a robot at this place."""
    terrain = terrain_of(belief, robot_xy, rules)
    x, y = terrain.grid.cells(np.array(robot_xy))
    return terrain, reach_from(terrain, (int(x), int(y)))


def as_view(belief: Belief, text: str = "sofa") -> SearchView:
    """The message that this belief would come from."""
    layers = (
        belief.observed * Layer.OBSERVED
        + belief.explored * Layer.EXPLORED
        + belief.searched * Layer.SEARCHED
    )
    return SearchView(
        text=text,
        revision=1,
        sequence=1,
        stamp_ns=0,
        grid=belief.grid,
        occupancy=belief.occupancy,
        layers=layers.astype(np.uint8),
        similarity=belief.similarity,
    )
