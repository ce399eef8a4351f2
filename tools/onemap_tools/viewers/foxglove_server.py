"""The WebSocket server that Foxglove and Lichtblick connect to."""

from __future__ import annotations

from typing import Any

from foxglove import Channel, Context, start_server
from foxglove.websocket import Capability, Client, Parameter, ServerListener

from onemap_tools.viewers.foxglove_topics import JSON, TYPED, json_schema

QUERY = "query"  # the one parameter: the text whose similarity is shown
MAX_QUERY_CHARS = 200
BACKLOG = 64  # messages for a slow viewer: 3 s; then the oldest go


class FoxgloveServer:
    """Offers all topics; nothing that a viewer sends changes more than ``query``."""

    def __init__(self, host: str, port: int, query: str) -> None:
        context = self._context = Context()  # its channels close when it is collected
        self._listener = _Parameters(query)
        self._channels = {
            topic: Channel(
                topic, schema=kind.get_schema(), message_encoding="protobuf", context=context
            )
            for topic, kind in TYPED.items()
        }
        for topic in JSON:
            self._channels[topic] = Channel(topic, schema=json_schema(topic), context=context)
        self._server = start_server(
            name="OneMap",
            host=host,
            port=port,
            capabilities=[Capability.Parameters],
            server_listener=self._listener,
            context=context,
            message_backlog_size=BACKLOG,
        )

    @property
    def port(self) -> int:
        """Where it listens."""
        return self._server.port

    @property
    def query(self) -> str:
        """The text that the viewers ask for; empty: that of the search."""
        return self._listener.query

    def wanted(self, topic: str) -> bool:
        """Whether a viewer has subscribed to this topic."""
        return self._channels[topic].has_sinks()

    def send(self, topic: str, message: Any, now_ns: int) -> None:
        """Send a message of the type of the topic, or a dict where that is JSON."""
        data = message if isinstance(message, dict) else message.encode()
        self._channels[topic].log(data, log_time=now_ns)

    def close(self) -> None:
        """Stop the server and its connections."""
        self._server.stop()


class _Parameters(ServerListener):
    """Holds the query; called from the server's threads."""

    def __init__(self, query: str) -> None:
        self.query = query

    def on_get_parameters(
        self,
        client: Client,  # noqa: ARG002
        param_names: list[str],  # noqa: ARG002
        request_id: str | None = None,  # noqa: ARG002
    ) -> list[Parameter]:
        return [Parameter(QUERY, value=self.query)]

    def on_set_parameters(
        self,
        client: Client,  # noqa: ARG002
        parameters: list[Parameter],
        request_id: str | None = None,  # noqa: ARG002
    ) -> list[Parameter]:
        for parameter in parameters:
            value = parameter.get_value()
            if parameter.name == QUERY and isinstance(value, str):
                self.query = value.strip()[:MAX_QUERY_CHARS]
        return [Parameter(QUERY, value=self.query)]
