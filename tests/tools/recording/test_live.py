"""What a viewer gets of what travels on the bus."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any

import psutil
import pytest

pytest.importorskip("foxglove", reason="needs foxglove-sdk: pip install -e '.[live]'")
pytest.importorskip("google.protobuf", reason="needs protobuf, which onnx brings")

from onemap_mapper.robots import MapperTelemetry
from onemap_perception.service import PerceptionTelemetry
from onemap_planner.config import PlannerConfig
from onemap_planner.service import Planner
from onemap_shared import keys
from onemap_shared import messages as m
from onemap_shared.transport import Counters
from onemap_tools.errors import CliError
from onemap_tools.recording import foxglove as convert
from onemap_tools.recording import foxglove_server as topics
from onemap_tools.recording import live
from onemap_tools.recording.foxglove_server import MAX_QUERY_CHARS, FoxgloveServer
from tests.gateway import fakes
from tests.memory_bus import MemoryRouter
from tests.shared.samples import KEPT
from tests.structure import ROOT
from tests.tools.recording.foxglove_client import FoxgloveClient, read

OFFERED = {*topics.TYPED, *topics.JSON}


class FakeServer:
    """Keeps what is sent, and refuses what nobody wants."""

    def __init__(self) -> None:
        self.query = ""
        self.subscribed = set(OFFERED)
        self.sent: list[tuple[str, Any]] = []

    def wanted(self, topic: str) -> bool:
        return topic in self.subscribed

    def send(self, topic: str, message: Any, now_ns: int) -> None:
        assert self.wanted(topic)
        self.sent.append((topic, message))

    def take(self, topic: str) -> list[Any]:
        """The messages on a topic so far, and forget all."""
        found = [message for name, message in self.sent if name == topic]
        self.sent.clear()
        return found


class Robot:
    """A bus with a mapper that answers, and a viewer on it."""

    def __init__(self) -> None:
        self.router = MemoryRouter()
        self.server = FakeServer()
        self.asked: list[str] = []
        self.bus = self.router.bus("robot")
        self.viewer = live.LiveViewer(self.router.bus("viewer"), self.server)  # type: ignore[arg-type]
        self.now_s = 0.0

    def with_mapper(self) -> Robot:
        def view(request: m.SearchViewRequest) -> m.SearchView:
            self.asked.append(request.text)
            return fakes.search_view(request.text)

        self.bus.serve(keys.MAP_SEARCH_VIEW, view)
        self.bus.serve(keys.MAP_OBJECTS, lambda _: m.ObjectList((KEPT,)))
        return self

    def publish(self, topic: Any, *messages: Any) -> None:
        publisher = self.bus.publish(topic)
        for message in messages:
            publisher.put(message)

    def update(self, after_s: float = 0.01) -> None:
        self.now_s += after_s
        self.viewer.update(self.now_s, fakes.STAMP_NS + int(self.now_s * 1e9))


@pytest.fixture
def robot() -> Robot:
    return Robot()


ODOMETRY, DETECTIONS = fakes.odometry(1.0, 2.0), fakes.detections("sofa")
SHOWN: list[tuple[Any, Any, set[str]]] = [
    (
        keys.ROBOT_RGBD,
        fakes.rgbd(),
        {topics.IMAGE, topics.POINTS, topics.CALIBRATION, topics.TRANSFORMS},
    ),
    (keys.ROBOT_ODOMETRY, ODOMETRY, {topics.TRANSFORMS, topics.ROBOT, topics.MOTION}),
    (keys.ROBOT_CMD_VEL, m.VelocityCommand(1, 1, 0.2, 0.1), {topics.COMMAND}),
    (keys.DETECTIONS, DETECTIONS, {topics.BOXES, topics.DETECTED}),
    (keys.MAP_REVISION, fakes.revision(3), {topics.MAP_STATE}),
    (keys.SEARCH_STATE, fakes.search(), {topics.SEARCH, topics.LOG}),
    (keys.SEARCH_PATH, fakes.planned_path((0.0, 0.0)), {topics.PLAN}),
    (
        keys.heartbeat("mapper"),
        fakes.heartbeat("mapper"),
        {topics.service_topic("mapper"), topics.LOG},
    ),
]


@pytest.mark.parametrize(
    ("stream", "message", "shown"), SHOWN, ids=lambda value: getattr(value, "key", "")
)
def test_a_message_is_passed_on(robot: Robot, stream: Any, message: Any, shown: set[str]) -> None:
    robot.update()  # nothing is repeated after it for a while
    robot.server.sent.clear()
    robot.publish(stream, message)
    robot.update()
    assert sorted(topic for topic, _ in robot.server.sent) == sorted(shown)


def test_the_map_is_asked_for_once_per_change(robot: Robot) -> None:
    robot.with_mapper()
    robot.publish(keys.MAP_REVISION, fakes.revision(3))
    robot.update()
    assert len(robot.server.take(topics.OCCUPANCY)) == 1
    robot.update(live.MAP_EVERY_S)
    assert robot.server.take(topics.OCCUPANCY) == []
    robot.publish(keys.MAP_REVISION, fakes.revision(4))
    robot.update(live.MAP_EVERY_S)
    assert len(robot.server.take(topics.OCCUPANCY)) == 1


@pytest.mark.parametrize(("query", "text"), [("", "sofa"), ("bed", "bed")])
def test_the_similarity_is_that_of_the_query_or_of_the_search(
    robot: Robot, query: str, text: str
) -> None:
    robot.with_mapper().server.query = query
    robot.publish(keys.SEARCH_STATE, fakes.search(objects=("sofa",)))
    robot.update()
    assert robot.asked == [text]
    assert len(robot.server.take(topics.SIMILARITY)) == 1


def test_without_a_mapper_the_log_says_so_once(robot: Robot) -> None:
    robot.update()
    robot.update(live.REPEAT_S)
    lines = [read(line) for line in robot.server.take(topics.LOG)]
    assert sorted(line.name for line in lines) == ["map", "objects"]
    assert all("no " in line.message.lower() for line in lines)


def test_the_plan_goes_when_the_search_ends(robot: Robot) -> None:
    robot.publish(keys.SEARCH_PATH, fakes.planned_path((0.0, 0.0), (1.0, 0.0)))
    robot.publish(keys.DETECTIONS, fakes.detections("sofa"))
    robot.update()
    robot.server.sent.clear()
    robot.publish(keys.SEARCH_STATE, fakes.search(state=m.SearchState.FOUND))
    robot.update()
    sent = dict(robot.server.sent)
    path = next(entity for entity in read(sent[topics.PLAN]).entities if entity.id == "path")
    assert len(path.lines[0].points) == 0
    assert len(read(sent[topics.BOXES]).points) == 0


def test_a_problem_is_logged_when_it_begins_and_when_it_ends(robot: Robot) -> None:
    beats: list[Callable[[], Any]] = [
        lambda: fakes.heartbeat("mapper", 1, problem="no frames"),
        lambda: fakes.heartbeat("mapper", 2, problem="no frames"),
        lambda: fakes.heartbeat("mapper", 3),
    ]
    for beat in beats:
        robot.publish(keys.heartbeat("mapper"), beat())
        robot.update()
    lines = [read(message) for topic, message in robot.server.sent if topic == topics.LOG]
    assert [line.message for line in lines if line.name == "mapper"] == ["no frames", "is well"]


def test_a_port_that_is_taken_is_one_sentence() -> None:
    other = FoxgloveServer(live.HOST, 0, "")
    try:
        with pytest.raises(CliError, match=f"Cannot listen on {live.HOST}:{other.port} .*--port"):
            live.listening(other.port, "")
    finally:
        other.close()


@pytest.fixture
def server() -> Iterator[FoxgloveServer]:
    made = FoxgloveServer("127.0.0.1", 0, "sofa")
    yield made
    made.close()


@pytest.fixture
def client(server: FoxgloveServer) -> Iterator[FoxgloveClient]:
    with closing(FoxgloveClient(server.port)) as made:
        made.discover(len(OFFERED))
        yield made


def test_every_topic_is_offered_on_loopback_and_nothing_is_taken(
    server: FoxgloveServer, client: FoxgloveClient
) -> None:
    listeners = {
        connection.laddr.ip
        for connection in psutil.Process().net_connections("tcp")
        if connection.status == psutil.CONN_LISTEN and connection.laddr.port == server.port
    }
    assert listeners == {live.HOST}
    assert set(client.channels) == OFFERED
    assert client.info["name"] == "OneMap"
    assert set(client.info["capabilities"]) == {"parameters", "parametersSubscribe"}
    image = client.channels[topics.IMAGE]
    assert (image["encoding"], image["schemaName"]) == ("protobuf", "foxglove.CompressedImage")
    assert client.channels[topics.MOTION]["encoding"] == "json"


def test_messages_arrive_as_they_were_sent(server: FoxgloveServer, client: FoxgloveClient) -> None:
    client.subscribe(topics.MOTION, topics.LOG)
    client.send({"op": "getParameters", "parameterNames": [], "id": "1"})
    client.next_json("parameterValues")
    server.send(topics.MOTION, {"linear_mps": 0.5, "angular_radps": 0.0}, 5)
    server.send(topics.LOG, convert.log_line("mapper", "is well", fakes.STAMP_NS), 6)
    assert client.receive() == (topics.MOTION, {"linear_mps": 0.5, "angular_radps": 0.0})
    topic, line = client.receive()
    assert (topic, line.name, line.message) == (topics.LOG, "mapper", "is well")


def test_the_query_is_a_parameter(server: FoxgloveServer, client: FoxgloveClient) -> None:
    for value, query in ((3, "sofa"), (" bed ", "bed"), ("x" * 999, "x" * MAX_QUERY_CHARS)):
        parameters = [{"name": "query", "value": value}, {"name": "other", "value": "no"}]
        client.send({"op": "setParameters", "parameters": parameters, "id": "1"})
        (answer,) = client.next_json("parameterValues")["parameters"]
        assert (answer["name"], answer["value"]) == ("query", query)
        assert server.query == query


LAYOUT = ROOT / "deploy" / "foxglove" / "onemap.json"
PAGE = ROOT / "docs" / "viewers.md"
TOPIC = re.compile(r"`(/[a-z_/]+)`")
PANELS: dict[str, Any] = json.loads(LAYOUT.read_text(encoding="utf-8"))["configById"]
PLOTTED = [path["value"] for panel in PANELS.values() for path in panel.get("paths", ())]


def test_the_layout_and_the_page_name_topics_that_are_offered() -> None:
    shown = {path.split(".")[0] for path in PLOTTED}
    for config in PANELS.values():
        shown |= set(config.get("topics", ()))
        shown |= {config[key] for key in ("topicPath", "topicToRender") if key in config}
    image = PANELS["Image!camera"]["imageMode"]
    shown |= {image["imageTopic"], image["calibrationTopic"], *image["annotations"]}
    assert len(shown) > 12
    assert shown - OFFERED == set()
    named = set(TOPIC.findall(PAGE.read_text(encoding="utf-8")))
    services = {topic for topic in OFFERED if topic.startswith("/services/")}
    assert OFFERED - services <= named
    assert named <= OFFERED | {"/services/"}


def test_the_plots_show_numbers_that_are_sent() -> None:
    planner = Planner(MemoryRouter().bus("planner"), PlannerConfig())
    perception = PerceptionTelemetry(started_s=0.0)
    perception.frame_done(1.0, encode_ms=1.0, frame_age_ms=2.0)
    perception.detection_done(1.0)
    metrics = {
        "perception": perception.timings,
        "mapper": MapperTelemetry().metrics(1.0, Counters()),
        "planner": planner.health().metrics or {},
    }
    planner.close()
    for path in PLOTTED:
        topic, *fields = path.split(".")
        assert fields[0] in topics.JSON[topic], path
        if fields[0] == "metrics":
            assert fields[1] in metrics[topic.rpartition("/")[2]], path


def test_json_messages_have_the_fields_of_their_schema() -> None:
    now_ns = fakes.STAMP_NS + 2 * 10**9
    sent = {
        topics.MOTION: convert.speed(fakes.odometry(0.0, 0.0)),
        topics.MAP_STATE: convert.map_state(fakes.revision(3), now_ns),
        topics.SEARCH: convert.search_state(fakes.search()),
        topics.service_topic("mapper"): convert.service_state(fakes.heartbeat("mapper")),
    }
    for topic, document in sent.items():
        assert set(document) == set(topics.json_schema(topic)["properties"]), topic
        json.dumps(document)
    assert sent[topics.MAP_STATE]["age_s"] == 2.0
    assert sent[topics.SEARCH]["target"] == "sofa"
