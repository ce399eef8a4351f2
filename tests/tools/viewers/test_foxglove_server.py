"""The server, seen by a client that speaks the protocol."""

from __future__ import annotations

from collections.abc import Iterator

import psutil
import pytest

pytest.importorskip("foxglove", reason="needs foxglove-sdk: pip install 'onemap[live]'")
pytest.importorskip("google.protobuf", reason="needs protobuf, which onnx brings")

from onemap_tools.viewers import foxglove_topics as topics
from onemap_tools.viewers.foxglove_server import MAX_QUERY_CHARS, FoxgloveServer
from tests.gateway import fakes
from tests.tools.viewers.foxglove_client import FoxgloveClient

COUNT = len(topics.TYPED) + len(topics.JSON)


@pytest.fixture
def server() -> Iterator[FoxgloveServer]:
    made = FoxgloveServer("127.0.0.1", 0, "sofa")
    yield made
    made.close()


@pytest.fixture
def client(server: FoxgloveServer) -> Iterator[FoxgloveClient]:
    with FoxgloveClient(server.port) as made:
        made.discover(COUNT)
        yield made


def test_every_topic_is_offered_with_its_schema(client: FoxgloveClient) -> None:
    assert set(client.channels) == {*topics.TYPED, *topics.JSON}
    assert client.info["name"] == "OneMap"
    image = client.channels[topics.IMAGE]
    assert (image["encoding"], image["schemaName"]) == ("protobuf", "foxglove.CompressedImage")
    assert client.channels[topics.MOTION]["encoding"] == "json"


def test_a_viewer_can_send_nothing(client: FoxgloveClient) -> None:
    assert set(client.info["capabilities"]) == {"parameters", "parametersSubscribe"}


def test_only_what_is_subscribed_is_wanted(server: FoxgloveServer, client: FoxgloveClient) -> None:
    assert not server.wanted(topics.MOTION)
    client.subscribe(topics.MOTION)
    client.send({"op": "getParameters", "parameterNames": [], "id": "1"})
    client.next_json("parameterValues")  # the server has read what was sent before
    assert server.wanted(topics.MOTION)
    assert not server.wanted(topics.IMAGE)


def test_messages_arrive_as_they_were_sent(server: FoxgloveServer, client: FoxgloveClient) -> None:
    client.subscribe(topics.MOTION, topics.LOG)
    client.send({"op": "getParameters", "parameterNames": [], "id": "1"})
    client.next_json("parameterValues")
    server.send(topics.MOTION, {"linear_mps": 0.5, "angular_radps": 0.0}, 5)
    server.send(topics.LOG, topics.log_line("mapper", "is well", fakes.STAMP_NS), 6)
    assert client.receive() == (topics.MOTION, {"linear_mps": 0.5, "angular_radps": 0.0})
    topic, line = client.receive()
    assert (topic, line.name, line.message) == (topics.LOG, "mapper", "is well")


@pytest.mark.parametrize(
    ("value", "query"), [(" bed ", "bed"), ("x" * 999, "x" * MAX_QUERY_CHARS), (3, "sofa")]
)
def test_the_query_is_a_parameter(
    server: FoxgloveServer, client: FoxgloveClient, value: object, query: str
) -> None:
    parameters = [{"name": "query", "value": value}, {"name": "other", "value": "no"}]
    client.send({"op": "setParameters", "parameters": parameters, "id": "1"})
    (answer,) = client.next_json("parameterValues")["parameters"]
    assert (answer["name"], answer["value"]) == ("query", query)
    assert server.query == query


def test_it_listens_where_it_is_told_and_nowhere_else(server: FoxgloveServer) -> None:
    listeners = {
        connection.laddr.ip
        for connection in psutil.Process().net_connections("tcp")
        if connection.status == psutil.CONN_LISTEN and connection.laddr.port == server.port
    }
    assert listeners == {"127.0.0.1"}
