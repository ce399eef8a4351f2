"""The map of a robot, and its files."""

from __future__ import annotations

from urllib.parse import quote

from onemap.connection import FILE_TIMEOUT_S, Connection
from onemap.errors import InvalidSetting
from onemap.replies import MapContent, MapStatistics, StoredMap


class MapFiles:
    """The robot's map: ``client.maps``. Files lie in the mapper's map folder."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection

    def info(self) -> MapStatistics:
        """Extent, areas and update rate of the map."""
        return self._connection.fetch(MapStatistics.of, "GET", "/v1/map")

    def list(self) -> tuple[StoredMap, ...]:
        """The saved maps, newest first."""
        return self._connection.fetch(
            lambda document: tuple(map(StoredMap.of, document["maps"])), "GET", "/v1/maps"
        )

    def get(self, name: str) -> StoredMap:
        """Size, encoder and time of a saved map."""
        return self._connection.fetch(StoredMap.of, "GET", _path(name))

    def save(self, name: str) -> MapContent:
        """Write the map to a file; an older one is replaced."""
        return self._change("PUT", _path(name))

    def load(self, name: str) -> MapContent:
        """Replace the map by a saved one; refused if another encoder made it."""
        return self._change("POST", f"{_path(name)}/load")

    def merge(
        self, name: str, *, x_m: float = 0.0, y_m: float = 0.0, yaw_rad: float = 0.0
    ) -> MapContent:
        """Fuse a saved map into the map in use: turned by ``yaw_rad``, then moved.

        Its frame is that of the map in use unless a motion is given.
        """
        motion = {"x_m": x_m, "y_m": y_m, "yaw_rad": yaw_rad}
        return self._connection.fetch(
            MapContent.of, "POST", f"{_path(name)}/merge", motion, timeout_s=FILE_TIMEOUT_S
        )

    def delete(self, name: str) -> StoredMap:
        """Delete a file and say what it was; the map in use stays."""
        return self._connection.fetch(StoredMap.of, "DELETE", _path(name))

    def clear(self) -> MapContent:
        """Delete the content of the map."""
        return self._connection.fetch(MapContent.of, "POST", "/v1/map/clear")

    def archive(self, text: str = "") -> bytes:
        """Occupancy, layers and geometry of the map, as an ``.npz`` file for ``numpy.load``.

        text: also the similarity of every cell to it.
        """
        path = f"/v1/map.npz?text={quote(text)}" if text else "/v1/map.npz"
        return self._connection.download(path, timeout_s=FILE_TIMEOUT_S)

    def _change(self, method: str, path: str) -> MapContent:
        return self._connection.fetch(MapContent.of, method, path, timeout_s=FILE_TIMEOUT_S)


def _path(name: str) -> str:
    if not name or "/" in name or name.startswith("."):  # would be another address
        raise InvalidSetting(f"{name!r} is no name of a map: it begins with a letter or a digit.")
    return f"/v1/maps/{quote(name, safe='')}"
