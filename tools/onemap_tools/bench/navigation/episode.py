"""One episode: drawn by seed, run in simulated time, judged by the simulator's ground truth."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from contextlib import closing
from dataclasses import asdict, dataclass, field, replace
from functools import reduce
from math import inf, isfinite
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from onemap_perception.config import SHIPPED
from onemap_perception.feature_field import VarianceParams
from onemap_perception.service import PerceptionComponents, components_of
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.camera import Intrinsics
from onemap_shared.geometry import F64
from onemap_shared.names import normalised
from onemap_simulator.errors import ERRORS
from onemap_simulator.generation.apartment import generate_apartment
from onemap_simulator.generation.stairwell import Opening, with_stairwell
from onemap_simulator.generation.style import STYLES
from onemap_simulator.ground_truth.truth import SceneTruth
from onemap_simulator.parts import scene_truth
from onemap_simulator.physics.people import NOBODY, Bystanders
from onemap_simulator.rendering.label_renderer import LabelRenderer
from onemap_simulator.rendering.rendered_image import RenderedImage, with_person
from onemap_simulator.rendering.renderer import Renderer
from onemap_simulator.rendering.rgbd_camera import SceneRenderer
from onemap_simulator.scene.scene import Scene
from onemap_simulator.service import SimulatorWorker
from onemap_tools.bench.navigation.described import painted
from onemap_tools.bench.navigation.drawing import (
    NavigationEpisode,
    deepest_m,
    draw_described,
    draw_episode,
    draw_openings,
    draw_zones,
)
from onemap_tools.bench.navigation.methods import search_method
from onemap_tools.bench.navigation.results import (
    OBJECT,
    STARTED_S,
    EpisodeRecord,
    Failure,
    ObjectRecord,
)
from onemap_tools.bench.navigation.rooms import room_ious
from onemap_tools.bench.navigation.search import SearchEnd, WatchedSearch
from onemap_tools.bench.navigation.simulated_perception import (
    UNCALIBRATED,
    SimulatedDetector,
    SimulatedDetectorParams,
    SimulatedEncoder,
    SimulatedFeatureParams,
)
from onemap_tools.bench.options import NavigationBench
from onemap_tools.judgement import ObjectSummary, evaluate_result
from onemap_tools.virtual.config import SystemConfig
from onemap_tools.virtual.latency import NO_LATENCIES, Latencies
from onemap_tools.virtual.link import Link
from onemap_tools.virtual.system import Equipment, simulated

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
    latencies: Latencies = NO_LATENCIES


@dataclass(slots=True)
class FrameCounts:
    """In how many frames each object was in view and detected while it was sought."""

    in_view: Counter[str] = field(default_factory=Counter)
    detected: Counter[str] = field(default_factory=Counter)

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
        if options.goals == "colours":
            scene = painted(scene, simulator.seed)
        episode, truth = draw_described(scene, simulator, options.goals)
    openings = draw_openings(scene, truth, episode, simulator, options.stairwells)
    if openings:
        scene = reduce(with_stairwell, openings, scene)
        described = episode.described
        truth = scene_truth(described.marked(scene) if described else scene, simulator)
    record = EpisodeRecord(
        setup.index,
        simulator.seed,
        episode.start,
        stairwells=openings,
        phrase=episode.described.phrase if episode.described else "",
        zones=draw_zones(scene, truth, episode, simulator, options.zones),
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
    options, config, described = setup.options, system_config(setup), episode.described
    if ERRORS[config.simulator.errors].people:
        scene = with_person(scene)
    labels, counts = LabelRenderer(scene), FrameCounts()
    camera = RememberingRenderer(Renderer(scene) if options.features == "mini" else labels)
    categories = [normalised(thing.category) for thing in scene.objects]
    if described:
        categories[described.meant] = normalised(described.phrase)

    def detected(found: m.Detections, status: m.SearchStatus) -> None:
        if not status.target:
            return
        shown = names_in_view(labels, camera.truths[found.sequence], config, categories)
        name = described.phrase if described else status.target
        if normalised(name) in shown:
            counts.add(name, status.target in found.names)

    def records(results: Sequence[m.ObjectResult]) -> tuple[ObjectRecord, ...]:
        ended = {result.name for result in results}
        missing = [not_sought(name) for name in episode.objects if name not in ended]
        summaries = [judged(result, truth) for result in (*results, *missing)]
        if described:
            summaries = [described.judged(scene, summary) for summary in summaries]
        return tuple(object_record(summary, counts) for summary in summaries)

    with TemporaryDirectory() as folder:
        search = WatchedSearch(
            Equipment(
                config,
                simulated(scene, config.simulator, camera),
                perception(scene, setup, config),
                Path(folder),
                latencies=setup.latencies,
                link=link_of(options),
            ),
            config.simulator.seed,
            method=search_method(options.method, config.mapper.cell_size_m),
            places=(*zone_places(record.zones), *(described.places if described else ())),
            detected=detected,
        )
        with closing(search):
            status = search.run(
                m.SearchRequest(
                    (described.noun,) if described else episode.objects,
                    details=(described.detail,) if described else (),
                ),
                options.limit * len(episode.objects) * OVERALL_LIMIT,
            )
            view = search.ask(keys.MAP_SEARCH_VIEW, m.SearchViewRequest())
    results = true_results(status.results, search.method.ends)
    if described:
        results = tuple(replace(result, name=described.phrase) for result in results)
    planning_ms = 1e3 * np.quantile(search.method.planning_s, (0.5, 0.95))
    return replace(
        record_of(record, search),
        objects=records(results),
        in_zone_m=deepest_m(search.path, record.zones, config.simulator.robot.radius_m),
        room_ious=tuple(room_ious(view, scene)),
        planning_p50_ms=float(planning_ms[0]),
        planning_p95_ms=float(planning_ms[1]),
    )


def record_of(record: EpisodeRecord, search: WatchedSearch) -> EpisodeRecord:
    """The record with what the simulator counted, and where the robot drove."""
    assert isinstance(search.robot, SimulatorWorker)
    parts = search.robot.parts
    return replace(
        record,
        contacts=parts.simulation.counts.collisions,
        people_touched=parts.simulation.counts.people_touched,
        edges_crossed=parts.simulation.counts.edges_crossed,
        frames_lost=parts.link.lost,
        pose_jumps=parts.localisation.jumps,
        pose_error_m=round(parts.localisation.largest_error_m, 3),
        simulated_s=round(search.simulated_s, 3),
        trajectory=tuple(search.trajectory),
        start_m=search.driven_m(STARTED_S),
    )


def zone_places(zones: Sequence[Opening]) -> tuple[m.Place, ...]:
    """The rectangles as keep-out places."""
    return tuple(
        m.Place(
            f"zone {index}",
            m.PlaceKind.KEEP_OUT,
            corners_m=((x0, y0), (x1, y0), (x1, y1), (x0, y1)),
        )
        for index, (x0, y0, x1, y1) in enumerate(zones)
    )


def true_results(
    results: Sequence[m.ObjectResult], ends: Sequence[SearchEnd]
) -> tuple[m.ObjectResult, ...]:
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


def link_of(options: NavigationBench) -> Link | None:
    """Between perception and the router; None for one without limits."""
    if not (options.link or options.delay or options.jitter):
        return None
    bytes_per_s = options.link * 1e6 / 8 if options.link else inf
    return Link(1e-3 * options.delay, 1e-3 * options.jitter, bytes_per_s=bytes_per_s)


def perception(scene: Scene, setup: EpisodeSetup, config: SystemConfig) -> PerceptionComponents:
    """The configured perception, or the simulated one with the errors of the apartment's seed."""
    if setup.options.features == "mini":
        return components_of(config.perception)
    seed = config.simulator.seed
    calibrated = setup.options.features == "simulated"
    params = SimulatedFeatureParams() if calibrated else UNCALIBRATED
    encoder = SimulatedEncoder(scene, SHIPPED, params, np.random.default_rng((seed, 1)))
    detector = SimulatedDetector(scene, SimulatedDetectorParams(), seed)
    return PerceptionComponents(encoder, detector, VarianceParams(config.perception.variance))


@dataclass(frozen=True, slots=True)
class FrameTruth:
    """Of a frame: the true T_map_camera (4, 4) of its capture, and where people were then."""

    T_map_camera: F64
    people: Bystanders


class RememberingRenderer:
    """A renderer that keeps the truth of each frame, by its sequence; a ``SceneRenderer``."""

    def __init__(self, renderer: SceneRenderer) -> None:
        self._renderer = renderer
        self.truths: list[FrameTruth] = []

    def render(
        self,
        T_map_camera: F64,
        intrinsics: Intrinsics,
        *,
        width: int,
        height: int,
        people: Bystanders = NOBODY,
    ) -> RenderedImage:
        """See ``SceneRenderer``."""
        self.truths.append(FrameTruth(T_map_camera, people))
        size = {"width": width, "height": height}
        return self._renderer.render(T_map_camera, intrinsics, **size, people=people)


def names_in_view(
    labels: LabelRenderer, truth: FrameTruth, config: SystemConfig, categories: Sequence[str]
) -> set[str]:
    """The categories, one of each object, that are large enough in the frame to be detected."""
    (width, height), camera = VIEW_PX, config.simulator.camera
    image = labels.render(
        truth.T_map_camera,
        camera.intrinsics.scaled(width / camera.width, height / camera.height),
        width=width,
        height=height,
        people=truth.people,
    )
    pixels = np.bincount(image.labels[image.labels >= 0], minlength=len(categories))
    large = np.flatnonzero(pixels >= IN_VIEW_SHARE * width * height)
    return {categories[index] for index in large.tolist()}


def judged(result: m.ObjectResult, truth: SceneTruth) -> ObjectSummary:
    """The result beside the ground truth; a search that was not begun has failed."""
    summary = evaluate_result(
        asdict(result),
        result.name,
        lambda name, place: truth.reply(m.TruthRequest(name, *place[:2])),
    )
    return replace(summary, judged=True)


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
    if judged.outcome == m.SearchState.FOUND_OTHER.value:
        return Failure.FOUND_OTHER
    if judged.outcome == m.SearchState.FAILED.value and not is_timeout(judged.reason):
        return Failure.STUCK
    if not in_view:
        return Failure.NEVER_IN_VIEW
    return Failure.NOT_ACCEPTED if detected else Failure.NOT_DETECTED


def is_timeout(reason: str) -> bool:
    """Whether the reason of a result is its time limit."""
    return "the limit" in reason or reason == "the time was over"


def not_sought(name: str) -> m.ObjectResult:
    """The result for an object that the search did not come to."""
    return m.ObjectResult(
        name, m.SearchState.NOT_FOUND, "the time was over", (), 0.0, 0.0, 0.0, (), ()
    )


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
            outcome=(m.SearchState.FOUND if reached else m.SearchState.NOT_FOUND).value,
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
