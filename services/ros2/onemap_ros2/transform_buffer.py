"""Transforms of a ROS 2 robot over time: interpolated between stamps, never extrapolated."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from onemap_shared.geometry import F64, inverse

KEPT_NS = 10_000_000_000  # as tf2: older transforms than the newest of their frame by 10 s go
SILENT_S = 3.0  # of a transform in a loop, after which it no longer counts; localisation: 1 Hz
MAX_LENGTH = 1e3  # of a quaternion: it is scaled to 1, as long as that says which way it turns


class TransformError(Exception):
    """There is no transform for this time, and waiting will not bring it; one sentence."""


class TransformLate(TransformError):
    """The transform for this time may still arrive."""


def rigid(translation: tuple[float, ...], quaternion: tuple[float, ...]) -> F64:
    """The (4, 4) transform of a translation in metres and a quaternion x, y, z, w.

    Raises ValueError for a quaternion of length zero and for what is not finite; its text lacks
    the subject.
    """
    if not np.isfinite((*translation, *quaternion)).all():
        raise ValueError("contains NaN or infinity")
    length = float(np.linalg.norm(quaternion))
    if not 1.0 / MAX_LENGTH < length < MAX_LENGTH:
        raise ValueError(f"has a quaternion of length {length:g}, which must be 1")
    T = np.eye(4)
    T[:3, :3] = Rotation.from_quat(quaternion).as_matrix()
    T[:3, 3] = translation
    return T


@dataclass(slots=True)
class _Edge:
    """A frame's parent, and its transform to it at ascending times; no times: it is static.

    said_s: when the newest transform came, on a clock that never goes back; of a static one: None.
    """

    parent: str
    said_s: float | None = None
    stamps_ns: list[int] = field(default_factory=list)
    transforms: list[F64] = field(default_factory=list)

    def add(self, stamp_ns: int, T: F64) -> None:
        """In the order of arrival: what stands for this time or a later one is of another clock."""
        index = bisect_left(self.stamps_ns, stamp_ns)
        del self.stamps_ns[index:], self.transforms[index:]
        self.stamps_ns.append(stamp_ns)
        self.transforms.append(T)
        old = bisect_left(self.stamps_ns, stamp_ns - KEPT_NS)
        del self.stamps_ns[:old], self.transforms[:old]

    def at(self, stamp_ns: int, frame: str) -> F64:
        if not self.stamps_ns:
            return self.transforms[0]
        index = bisect_left(self.stamps_ns, stamp_ns)
        if index == len(self.stamps_ns):
            late_s = (stamp_ns - self.stamps_ns[-1]) * 1e-9
            raise TransformLate(
                f"{frame} in {self.parent} ends {late_s:.3f} s before the time asked for"
            )
        if self.stamps_ns[index] == stamp_ns:
            return self.transforms[index]
        if index == 0:
            early_s = (self.stamps_ns[0] - stamp_ns) * 1e-9
            raise TransformError(
                f"{frame} in {self.parent} begins {early_s:.3f} s after the time asked for"
            )
        return self._between(index, stamp_ns)

    def _between(self, index: int, stamp_ns: int) -> F64:
        start_ns, end_ns = self.stamps_ns[index - 1 : index + 1]
        earlier, later = self.transforms[index - 1 : index + 1]
        share = (stamp_ns - start_ns) / (end_ns - start_ns)
        T = np.eye(4)
        turns = Rotation.from_matrix(np.stack([earlier[:3, :3], later[:3, :3]]))
        T[:3, :3] = Slerp([0.0, 1.0], turns)(share).as_matrix()
        T[:3, 3] = (1.0 - share) * earlier[:3, 3] + share * later[:3, 3]
        return T


class TransformBuffer:
    """The tree of a robot's frames; where they form a loop, no transform is found."""

    def __init__(self) -> None:
        self._edges: dict[str, _Edge] = {}
        self._refused: dict[str, str] = {}  # by the frame that they would have placed
        self._newest_s = 0.0  # when the newest moving transform came

    def refuse(self, child: str, reason: str) -> None:
        """The newest transform of this frame cannot be used; a look-up that fails says so."""
        self._refused[child] = reason

    def add(
        self, parent: str, child: str, stamp_ns: int, T_parent_child: F64, said_s: float = 0.0
    ) -> None:
        """A transform of ``/tf``. A frame that gets another parent forgets the one before.

        said_s: when it came, in monotonic seconds.
        """
        edge = self._edges.get(child)
        if edge is None or edge.parent != parent or not edge.stamps_ns:
            edge = self._edges[child] = _Edge(parent)
        edge.add(stamp_ns, T_parent_child)
        edge.said_s = self._newest_s = said_s
        self._refused.pop(child, None)

    def add_static(self, parent: str, child: str, T_parent_child: F64) -> None:
        """A transform of ``/tf_static``: for all times."""
        self._edges[child] = _Edge(parent, None, [], [T_parent_child])
        self._refused.pop(child, None)

    def forget_motion(self) -> None:
        """Forget all but the static transforms: the clock jumped back."""
        self._edges = {c: edge for c, edge in self._edges.items() if not edge.stamps_ns}

    def lookup(self, target: str, source: str, stamp_ns: int) -> F64:
        """T_target_source (4, 4) at a time; TransformLate or TransformError if there is none."""
        try:
            return self._find(target, source, stamp_ns)
        except TransformError as problem:
            raise type(problem)("; ".join((str(problem), *self._refused.values()))) from problem

    def _find(self, target: str, source: str, stamp_ns: int) -> F64:
        below = set(self._to_root(source))
        for frame in self._to_root(target):
            if frame in below:
                common = frame
                break
        else:
            raise TransformLate(
                f"the frames {target!r} and {source!r} are not connected; known are "
                f"{', '.join(sorted(self._edges)) or 'none'}"
            )
        T_common_target = self._up(target, common, stamp_ns)
        return inverse(T_common_target) @ self._up(source, common, stamp_ns)

    def _to_root(self, frame: str) -> list[str]:
        """The frame and all above it; TransformError where they form a loop."""
        way = [frame]
        while (edge := self._edges.get(way[-1])) is not None:
            if edge.parent in way:
                self._break_loop(way[way.index(edge.parent) :])
                return self._to_root(frame)
            way.append(edge.parent)
        return way

    def _break_loop(self, loop: list[str]) -> None:
        """Forget what nobody says of these frames any more, or raise TransformError."""
        said = {frame: self._edges[frame].said_s for frame in loop}
        oldest_s = self._newest_s - SILENT_S
        silent = [f for f, at_s in said.items() if at_s is not None and at_s < oldest_s]
        if not silent:
            ways = " in ".join(map(repr, (*loop, loop[0])))
            static = ", and restart this adapter if it is one of /tf_static"
            raise TransformError(
                f"the transforms form a loop, {ways}: end the node that publishes the wrong one"
                + static * (None in said.values())
            )
        for frame in silent:
            del self._edges[frame]

    def _up(self, frame: str, above: str, stamp_ns: int) -> F64:
        T: F64 = np.eye(4)
        while frame != above:
            edge = self._edges[frame]
            T = edge.at(stamp_ns, frame) @ T
            frame = edge.parent
        return T
