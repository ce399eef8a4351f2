"""One episode: drawn by seed, run in simulated time, judged by the simulator's ground truth.

Stairwells open the floor on the shortest ways, with a way around each opening.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import reduce
from math import inf, isfinite

import numpy as np

from onemap_perception.config import SHIPPED
from onemap_shared.geometry import F64, Bool
from onemap_shared.messages import (
    Detections,
    ObjectResult,
    RgbdFrame,
    SearchOrder,
    SearchState,
    TruthRequest,
)
from onemap_shared.names import normalised
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.errors import ERRORS
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.stairwell import Opening, floor_around, with_stairwell
from onemap_simulator.generation.style import STYLES
from onemap_simulator.ground_truth.truth import CELL_SIZE_M, SceneTruth
from onemap_simulator.parts import scene_truth
from onemap_simulator.physics.collision import FLOOR_MARGIN_M, CollisionMap
from onemap_simulator.rendering.label_renderer import LabelRenderer
from onemap_simulator.rendering.rendered_image import with_person
from onemap_simulator.scene.cell_masks import connected_part
from onemap_simulator.scene.occupancy_raster import rasterise
from onemap_simulator.scene.scene import Scene
from onemap_tools.bench.lockstep import (
    FrameTruth,
    LockstepSimulation,
    PerceptionPipeline,
    SearchEnd,
    SimulatedRobot,
    SystemConfig,
)
from onemap_tools.bench.navigation.described import (
    DescribedObject,
    described_objects,
    draw_order,
    merged,
)
from onemap_tools.bench.navigation.methods import search_method
from onemap_tools.bench.navigation.results import (
    OBJECT,
    STARTED_S,
    EpisodeRecord,
    Failure,
    ObjectRecord,
)
from onemap_tools.bench.navigation.simulated_perception import (
    UNCALIBRATED,
    SimulatedDetector,
    SimulatedDetectorParams,
    SimulatedEncoder,
    SimulatedFeatureParams,
)
from onemap_tools.bench.options import GoalsName, NavigationBench, Parity
from onemap_tools.demo.summary import ObjectSummary, evaluate_result

# What somebody may send a robot to: furniture, appliances and things that stand on the floor.
# Cups and books are too small for the camera of the benchmark, pictures and curtains everywhere.
GOALS = frozenset(
    ("armchair", "bathtub", "bed", "bench", "bicycle", "bookcase", "chair", "coffee table", "desk")
    + ("dishwasher", "dresser", "fan", "guitar", "microwave", "nightstand", "oven", "potted plant")
    + ("refrigerator", "sink", "sofa", "stool", "suitcase", "table", "television", "toilet")
    + ("trash can", "wardrobe", "washing machine")
)
MIN_WAY_M = 1.0  # to each object, from the start or wherever the one before can be found
START_MARGIN_M = 0.1  # between the robot and obstacles at the start
# Of stairwells:
SIDES_M = ((0.5, 0.9), (0.7, 1.2))  # least and largest of the short and the long side
FROM_START_M = 1.2  # no camera sees the floor nearer at the start; the robot stands on floor
FROM_THINGS_M = 0.05  # rugs and furniture stay on floor
FROM_WALLS_M = 0.1
PASSING_M = 0.15  # beside the robot, on ways that stay open
ASIDE_M = 0.5  # of the shortest way, at most
DRAWS = 1000


@dataclass(frozen=True, slots=True)
class NavigationEpisode:
    """objects: categories to find, in this order; start: x, y in metres and yaw in radians."""

    objects: tuple[str, ...]
    start: tuple[float, float, float]
    described: DescribedObject | None = None  # if so, ``objects`` is its phrase


def apartment_seeds(first: int, count: int, apartments: Parity) -> tuple[int, ...]:
    """``count`` seeds from ``first`` on."""
    if apartments == "all":
        return tuple(range(first, first + count))
    parity = 0 if apartments == "even" else 1
    first += (first - parity) % 2
    return tuple(range(first, first + 2 * count, 2))


def draw_episode(
    scene: Scene, truth: SceneTruth, simulator: SimulatorConfig, objects: int
) -> NavigationEpisode:
    """The episode of the seed; ValueError if the scene has too few objects that can be reached."""
    rng = np.random.default_rng((simulator.seed, objects))
    start = _draw_start(scene, simulator, rng)
    left = [str(name) for name in rng.permutation(sorted(GOALS.intersection(scene.categories)))]
    chosen: list[str] = []
    while len(chosen) < objects:
        name = next((each for each in left if _is_away(each, chosen, start, truth)), None)
        if name is None:
            raise ValueError(
                f"{scene.name} has {len(chosen)} kinds of object that can be reached one after "
                f"the other, not {objects}; choose fewer with --objects-per-episode"
            )
        chosen.append(name)
        left.remove(name)
    return NavigationEpisode(tuple(chosen), start)


def draw_described(
    scene: Scene, simulator: SimulatorConfig, goals: GoalsName
) -> tuple[NavigationEpisode, SceneTruth]:
    """The episode of the seed for one object of several of its kind, with its ground truth.

    Drawn: the kind of relation, the class, the description. ValueError if the scene has none.
    """
    rng = np.random.default_rng((simulator.seed, 4))
    start = _draw_start(scene, simulator, rng)
    found = described_objects(scene, simulator, goals, GOALS | {"lamp"})
    for drawn in draw_order(found, rng):
        truth = scene_truth(drawn.marked(scene), simulator)
        if _is_away(drawn.phrase, [], start, truth):
            return NavigationEpisode((drawn.phrase,), start, drawn), truth
    raise ValueError(
        f"{scene.name} has no object of several of its kind that --goals {goals} could name and "
        "that can be reached; choose another --seed"
    )


def _draw_start(
    scene: Scene, simulator: SimulatorConfig, rng: np.random.Generator
) -> tuple[float, float, float]:
    """x, y, yaw of a reachable place with ``START_MARGIN_M`` to spare."""
    robot = simulator.robot
    collision = CollisionMap.of(scene, robot.height_m)
    reachable = collision.reachable_cells(*scene.start[:2], robot.radius_m)
    reachable &= collision.clearance >= robot.radius_m + START_MARGIN_M
    places = collision.grid.centres(np.argwhere(reachable))
    x, y = places[int(rng.integers(len(places)))].tolist()
    return x, y, float(rng.uniform(-np.pi, np.pi))


def _is_away(
    name: str, before: list[str], start: tuple[float, float, float], truth: SceneTruth
) -> bool:
    """Whether there is a way to it, not too short from the start or the object before."""
    from_start_m = truth.path_m(name, *start[:2])
    way_m = truth.least_way_m(before[-1], name) if before else from_start_m
    return bool(np.isfinite(from_start_m)) and way_m >= MIN_WAY_M


def draw_openings(
    scene: Scene,
    truth: SceneTruth,
    episode: NavigationEpisode,
    simulator: SimulatorConfig,
    count: int,
) -> tuple[Opening, ...]:
    """At most ``count`` openings, no two in a room, by the seed.

    Every object of the episode can still be reached, and with PASSING_M to spare where it could.
    """
    rng = np.random.default_rng((simulator.seed, 3))
    space = _Space(scene, truth, episode, simulator)
    chosen: dict[int, Opening] = {}  # by the floor of its room
    for _ in range(DRAWS):
        if len(chosen) == count:
            break
        opening = _draw(space.ways, rng)
        floor = floor_around(scene, opening, FROM_WALLS_M)
        openings = [*chosen.values(), opening]
        if floor is not None and floor not in chosen and space.allows(openings):
            chosen[floor] = opening
    return tuple(chosen.values())


def _draw(ways: Sequence[F64], rng: np.random.Generator) -> Opening:
    """A rectangle about a place beside one of the ways (N, 2)."""
    way = ways[int(rng.integers(len(ways)))]
    x, y = way[int(rng.integers(len(way)))] + rng.uniform(-ASIDE_M, ASIDE_M, 2)
    width, depth = rng.permutation([rng.uniform(*side) for side in SIDES_M])
    return float(x - width / 2), float(y - depth / 2), float(x + width / 2), float(y + depth / 2)


class _Space:
    """What of an apartment decides about openings, over the cells of the ground truth."""

    def __init__(
        self,
        scene: Scene,
        truth: SceneTruth,
        episode: NavigationEpisode,
        simulator: SimulatorConfig,
    ) -> None:
        self._start = np.array(episode.start[:2])
        self.ways = [truth.shortest_path(name, *episode.start[:2]) for name in episode.objects]
        collision = CollisionMap.of(scene, simulator.robot.height_m, CELL_SIZE_M)
        self._grid = collision.grid
        self._places = self._grid.centres(np.argwhere(np.ones(self._grid.shape, bool)))
        self._clearance = collision.clearance
        radius_m = simulator.robot.radius_m
        self._margins_m = (radius_m, radius_m + PASSING_M)
        things = np.array([thing.category != "floor" for thing in scene.objects])
        triangles = scene.vertices[scene.faces[things[scene.face_object]]].astype(np.float64)
        heights = (-FLOOR_MARGIN_M, simulator.robot.height_m)
        self._things = rasterise(triangles, self._grid, heights)
        self._goals = [truth.success_cells(name)[1] for name in episode.objects]
        self._needed = [self._goals_within(self._clearance >= m) for m in self._margins_m]

    def allows(self, openings: Sequence[Opening]) -> bool:
        """Whether nothing stands over them, the start is away, and all ways go on."""
        from_start = [_distances_m(opening, self._start[None]).min() for opening in openings]
        if min(from_start) < FROM_START_M:
            return False
        apart = np.min([_distances_m(opening, self._places) for opening in openings], axis=0)
        apart = apart.reshape(self._grid.shape)
        if (self._things & (apart <= FROM_THINGS_M)).any():
            return False
        clearance = np.minimum(self._clearance, apart)
        margins = zip(self._margins_m, self._needed, strict=True)
        return all(needed <= self._goals_within(clearance >= m) for m, needed in margins)

    def _goals_within(self, free: Bool) -> set[int]:
        """Objects that are reached over free cells from the one nearest to the start."""
        cells = np.argwhere(free)
        if len(cells) == 0:
            return set()
        apart = np.linalg.norm(self._grid.centres(cells) - self._start, axis=1)
        reached = connected_part(free, cells[int(apart.argmin())])
        return {index for index, goal in enumerate(self._goals) if (goal & reached).any()}


def _distances_m(opening: Opening, places: F64) -> F64:
    """Distances (N,) in metres of places (N, 2) from a rectangle; 0 inside."""
    lower, upper = np.array(opening[:2]), np.array(opening[2:])
    outside = np.maximum(np.maximum(lower - places, places - upper), 0.0)
    distances: F64 = np.linalg.norm(outside, axis=1)
    return distances


RGBD_HZ = 4.0  # what the services reach on two cores
SIMULATED_CAMERA_PX = (160, 120)  # labels need no texture; half the time of 320 x 240
VIEW_PX = (80, 60)  # of the labels by which it is decided what is in view
IN_VIEW_SHARE = 0.004  # of the image: what the simulated detector can detect
POINT_EVERY = 4  # cells of 5 cm between two points of the oracle's trajectory
OVERALL_LIMIT = 1.2  # of the sum of the objects' limits: the planner's own limit ends them


@dataclass(frozen=True, slots=True)
class EpisodeSetup:
    """One episode of a run; the configuration's simulator has the apartment's seed and style."""

    index: int
    config: SystemConfig
    options: NavigationBench


@dataclass(slots=True)
class FrameCounts:
    """In how many frames each object was in view and detected while it was sought, where the
    robot was in every frame, and the metres driven in the first ``STARTED_S``."""

    in_view: Counter[str] = field(default_factory=Counter)
    detected: Counter[str] = field(default_factory=Counter)
    trajectory: list[tuple[float, float]] = field(default_factory=list)
    start_m: float = 0.0

    def add(self, name: str, detected: bool) -> None:
        """Count a frame that shows the object that is sought."""
        self.in_view[name] += 1
        self.detected[name] += detected


def run_episode(setup: EpisodeSetup) -> EpisodeRecord:
    """Run the episode in simulated time; ``wall_s`` stays 0."""
    simulator, options = setup.config.simulator, setup.options
    scene = generate_apartment(simulator.seed, STYLES[simulator.style])
    if options.goals == "names":
        truth = scene_truth(scene, simulator)
        episode = draw_episode(scene, truth, simulator, options.objects_per_episode)
    else:
        episode, truth = draw_described(scene, simulator, options.goals)
    openings = draw_openings(scene, truth, episode, simulator, options.stairwells)
    if openings:
        scene = reduce(with_stairwell, openings, scene)
        described = episode.described
        truth = scene_truth(described.marked(scene) if described else scene, simulator)
    phrase = episode.described.phrase if episode.described else ""
    record = EpisodeRecord(
        setup.index, simulator.seed, episode.start, stairwells=openings, phrase=phrase
    )
    if options.method == "oracle":
        speed_mps = setup.config.planner.drive.max_linear_mps
        objects, trajectory = oracle_objects(truth, episode, speed_mps)
        time_s = sum(item.time_s for item in objects)
        return replace(record, objects=objects, trajectory=trajectory, simulated_s=time_s)
    return _search(replace(scene, start=episode.start), truth, episode, setup, record)


def _search(
    scene: Scene,
    truth: SceneTruth,
    episode: NavigationEpisode,
    setup: EpisodeSetup,
    record: EpisodeRecord,
) -> EpisodeRecord:
    options, config = setup.options, system_config(setup)
    if ERRORS[config.simulator.errors].people:
        scene = with_person(scene)
    labels, counts, described = LabelRenderer(scene), FrameCounts(), episode.described
    categories = [normalised(thing.category) for thing in scene.objects]
    robot = SimulatedRobot(scene, config.simulator, None if options.features == "mini" else labels)

    def watch(frame: RgbdFrame, found: Detections) -> None:
        counts.trajectory.append(simulation.xy)
        if simulation.now_s <= STARTED_S:
            counts.start_m = simulation.odometer_m
        target = simulation.state.search.target
        if not target:
            return
        pixels = pixels_in_view(labels, frame, robot.truth_of(frame), len(categories))
        shown = np.flatnonzero(pixels >= IN_VIEW_SHARE * VIEW_PX[0] * VIEW_PX[1])
        wanted = (
            [described.meant]
            if described
            else [index for index, name in enumerate(categories) if name == normalised(target)]
        )
        if not set(wanted).isdisjoint(shown.tolist()):
            counts.add(described.phrase if described else target, target in found.names)

    simulation = LockstepSimulation(
        robot,
        config,
        perception(scene, setup, config),
        method=search_method(options.method, config.mapper.cell_size_m),
        watch=watch,
    )
    limit_s = options.limit * len(episode.objects) * OVERALL_LIMIT

    def records(results: Sequence[ObjectResult]) -> tuple[ObjectRecord, ...]:
        ended = {result.name for result in results}
        missing = [not_sought(name) for name in episode.objects if name not in ended]
        summaries = [judged(result, truth) for result in (*results, *missing)]
        if described:
            summaries = [described.judged(scene, summary) for summary in summaries]
        return tuple(object_record(summary, counts) for summary in summaries)

    legs: tuple[ObjectResult, ...] = ()
    if described is None:
        search = simulation.search(episode.objects, limit_s, SearchOrder(options.order))
        results = true_results(search.results, simulation.ends)
    else:
        legs = search_legs(simulation, described, scene, limit_s, plain=options.method == "plain")
        results = merged(legs)
    return replace(
        record,
        objects=records(results),
        plain=records(legs[:1]) if options.method == "plain" else (),
        contacts=robot.simulation.counts.collisions,
        people_touched=robot.simulation.counts.people_touched,
        edges_crossed=robot.simulation.counts.edges_crossed,
        frames_lost=robot.link.lost,
        pose_jumps=robot.localisation.jumps,
        pose_error_m=round(robot.localisation.largest_error_m, 3),
        simulated_s=round(simulation.now_s, 3),
        trajectory=tuple(counts.trajectory),
        start_m=counts.start_m,
    )


def search_legs(
    simulation: LockstepSimulation,
    described: DescribedObject,
    scene: Scene,
    limit_s: float,
    *,
    plain: bool,
) -> tuple[ObjectResult, ...]:
    """The true result of the search, under the phrase.

    plain: for the noun alone; while what it claims is another one, it goes on without that one,
    as often as there are others, and each time has a result of its own.
    """
    details = () if plain else (described.detail,)
    search = simulation.search((described.noun,), limit_s, details=details)
    others = sum(thing.category == described.noun for thing in scene.objects) - 1
    legs: tuple[ObjectResult, ...] = ()
    while results := true_results(search.results, simulation.ends):
        legs = (*legs, replace(results[0], name=described.phrase))
        wrong = results[0].outcome is SearchState.FOUND and not described.is_meant(
            scene, results[0].position_m
        )
        if not (plain and wrong) or len(legs) > others:
            break
        search = simulation.search_on(limit_s)
    return legs


def true_results(
    results: Sequence[ObjectResult], ends: Sequence[SearchEnd]
) -> tuple[ObjectResult, ...]:
    """The results with true places, as the robot's pose at the end of each search tells.

    A search starts where the one before ended; at the first start the reported pose is true.
    """
    starts = (None, *ends)
    return tuple(
        replace(
            result,
            start_xy_m=start.true_place(result.start_xy_m) if start else result.start_xy_m,
            end_xy_m=end.true_place(result.end_xy_m),
            position_m=end.true_place(result.position_m),
        )
        for result, start, end in zip(results, starts, ends, strict=False)
    )


def system_config(setup: EpisodeSetup) -> SystemConfig:
    """The configuration of the episode: frame rate, camera, and the planner's limit."""
    camera = setup.config.simulator.camera
    if setup.options.features != "mini":
        width, height = SIMULATED_CAMERA_PX
        camera = camera.model_copy(update={"width": width, "height": height})
    limit_s = setup.options.limit
    return setup.config.searching(rgbd_hz=RGBD_HZ, limit_s=limit_s, camera=camera)


def perception(scene: Scene, setup: EpisodeSetup, config: SystemConfig) -> PerceptionPipeline:
    """The configured perception, or the simulated one with the errors of the apartment's seed."""
    if setup.options.features == "mini":
        return PerceptionPipeline(config.perception)
    seed = config.simulator.seed
    calibrated = setup.options.features == "simulated"
    params = SimulatedFeatureParams() if calibrated else UNCALIBRATED
    encoder = SimulatedEncoder(scene, SHIPPED, params, np.random.default_rng((seed, 1)))
    detector = SimulatedDetector(scene, SimulatedDetectorParams(), seed)
    return PerceptionPipeline(config.perception, encoder=encoder, detector=detector)


def pixels_in_view(
    labels: LabelRenderer, frame: RgbdFrame, truth: FrameTruth, objects: int
) -> np.ndarray:
    """Pixels (objects,) of each object in an image of ``VIEW_PX`` where the frame was captured."""
    (width, height), (rows, columns) = VIEW_PX, frame.depth_mm.shape
    image = labels.render(
        truth.T_map_camera,
        frame.intrinsics.scaled(width / columns, height / rows),
        width=width,
        height=height,
        people=truth.people,
    )
    return np.bincount(image.labels[image.labels >= 0], minlength=objects)


def judged(result: ObjectResult, truth: SceneTruth) -> ObjectSummary:
    """The result beside the ground truth."""
    return evaluate_result(
        asdict(result),
        result.name,
        lambda name, place: truth.reply(TruthRequest(name, *place[:2])),
    )


def object_record(judged: ObjectSummary, counts: FrameCounts) -> ObjectRecord:
    """The record of a judged result."""
    in_view, detected = counts.in_view[judged.name], counts.detected[judged.name]
    return OBJECT.validate_python(
        {
            **judged.document(),
            "in_view": in_view,
            "detected": detected,
            "failure": failure_of(judged, in_view, detected),
            "timed_out": not judged.claimed and is_timeout(judged.reason),
        }
    )


def failure_of(judged: ObjectSummary, in_view: int, detected: int) -> Failure:
    """Why the object does not count as found."""
    if judged.success:
        return Failure.NONE
    if judged.claimed:
        right = normalised(judged.nearest) == normalised(judged.name)
        return Failure.STOPPED_SHORT if right else Failure.WRONG_OBJECT
    if judged.outcome == SearchState.FOUND_OTHER.value:
        return Failure.FOUND_OTHER
    if judged.outcome == SearchState.FAILED.value and not is_timeout(judged.reason):
        return Failure.STUCK
    if not in_view:
        return Failure.NEVER_IN_VIEW
    return Failure.NOT_ACCEPTED if detected else Failure.NOT_DETECTED


def is_timeout(reason: str) -> bool:
    """Whether the reason of a result is its time limit."""
    return "the limit" in reason or reason == "the time was over"


def not_sought(name: str) -> ObjectResult:
    """The result for an object that the search did not come to."""
    return ObjectResult(name, SearchState.NOT_FOUND, "the time was over", (), 0.0, 0.0, 0.0, (), ())


def oracle_objects(
    truth: SceneTruth, episode: NavigationEpisode, speed_mps: float
) -> tuple[tuple[ObjectRecord, ...], tuple[tuple[float, float], ...]]:
    """The records of all objects and the positions on the way, driven at the highest speed."""
    here, records, trajectory = episode.start[:2], [], [episode.start[:2]]
    for name in episode.objects:
        length_m = truth.path_m(name, *here)
        path = truth.shortest_path(name, *here)
        reached = isfinite(length_m)
        if reached:
            trajectory += [(float(x), float(y)) for x, y in (*path[::POINT_EVERY], path[-1])]
            here = trajectory[-1]
        driven_m = length_m if reached else 0.0
        driven = ObjectSummary(
            name=name,
            outcome=(SearchState.FOUND if reached else SearchState.NOT_FOUND).value,
            reason="the shortest path" if reached else "no path leads there",
            position_m=(),
            time_s=driven_m / speed_mps,
            path_length_m=driven_m,
            shortest_path_m=length_m,
            true_distance_m=0.0,
            goal_distance_m=0.0 if reached else inf,
        )
        records.append(object_record(driven, FrameCounts()))
    return tuple(records), tuple(trajectory)
