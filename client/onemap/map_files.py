"""The map of a robot, and its files."""

from __future__ import annotations

from onemap.connection import FILE_TIMEOUT_S, Connection
from onemap.replies import MapContent, MapStatistics


class MapFiles:
    """The robot's map: ``client.maps``. Files lie in the mapper's map folder."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def info(self) -> MapStatistics:
        """Extent, areas and update rate of the map."""
        return self._connection.fetch(MapStatistics.of, "GET", "/v1/map")

    def save(self, name: str) -> MapContent:
        """Write the map to a file; an older one is replaced."""
        return self._change("save", name)

    def load(self, name: str) -> MapContent:
        """Replace the map by a saved one; refused if another encoder made it."""
        return self._change("load", name)

    def clear(self) -> MapContent:
        """Delete the content of the map."""
        return self._connection.fetch(MapContent.of, "POST", "/v1/map/clear")

    def archive(self) -> bytes:
        """Occupancy, layers and geometry of the map, as an ``.npz`` file for ``numpy.load``."""
        return self._connection.download("/v1/map.npz", timeout_s=FILE_TIMEOUT_S)

    def _change(self, verb: str, name: str) -> MapContent:
        return self._connection.fetch(
            MapContent.of, "POST", f"/v1/map/{verb}", {"name": name}, timeout_s=FILE_TIMEOUT_S
        )
