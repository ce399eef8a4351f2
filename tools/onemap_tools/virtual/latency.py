"""How long the stages of a robot compute, in virtual time, in which computing itself takes none."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, NonNegativeFloat, ValidationError

from onemap_mapper.frame.update import FrameUpdate, compute_update
from onemap_perception.detectors.protocol import Detection, Detector, Image
from onemap_perception.encoders.protocol import ImageEncoder
from onemap_perception.service import PerceptionComponents
from onemap_planner.method import PlanningMethod
from onemap_planner.policy.outcome import Observation, Outcome
from onemap_planner.policy.params import PlannerParams
from onemap_planner.policy.state import PlannerState
from onemap_planner.search.state_machine import Search
from onemap_planner.world.map_view import PlanningView
from onemap_shared.clock import Clock
from onemap_shared.geometry import F16, U8
from onemap_shared.messages import TextEmbeddings
from onemap_shared.transport import Bus

Times = Annotated[tuple[NonNegativeFloat, ...], Field(min_length=1)]


class Latencies(BaseModel):
    """Milliseconds of each stage: one value, or quantiles in even steps from least to most.

    As the services report them in their heartbeats, and ``onemap bench system`` in ``latency``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    encode_ms: Times = (0.0,)
    detect_ms: Times = (0.0,)
    update_ms: Times = (0.0,)
    plan_ms: Times = (0.0,)

    @classmethod
    def read(cls, file: Path) -> Latencies:
        """Of a JSON file: the table, or a result that has it; ValueError for another file."""
        try:
            document = json.loads(file.read_text(encoding="utf-8"))
            return cls.model_validate(document.get("latency", document))
        except (OSError, ValueError, AttributeError, ValidationError) as problem:
            raise ValueError(
                f"{file} holds no latencies: write it by 'onemap bench system --json': {problem}"
            ) from problem


NO_LATENCIES = Latencies()


@dataclass(frozen=True, slots=True)
class Delays:
    """Lets a process wait as long as its stages would compute; times are drawn from its clock's
    random numbers, evenly between neighbouring quantiles."""

    times: Latencies
    clock: Clock

    def wait(self, stage: str) -> None:
        """Wait as long as the stage takes once."""
        values: Sequence[float] = getattr(self.times, stage)
        if max(values) > 0:
            steps = np.linspace(0.0, 1.0, len(values))
            self.clock.sleep(1e-3 * float(np.interp(self.clock.random.random(), steps, values)))

    def components(self, made: PerceptionComponents) -> PerceptionComponents:
        """The components, as late."""
        encoder, detector = LateEncoder(made.encoder, self), LateDetector(made.detector, self)
        return PerceptionComponents(encoder, detector, made.variance)

    def update(self, *args: Any, **kwargs: Any) -> FrameUpdate:
        """As ``compute_update``, as late."""
        self.wait("update_ms")
        return compute_update(*args, **kwargs)


class LateEncoder:
    """Implements ``ImageEncoder``; texts take no time."""

    def __init__(self, encoder: ImageEncoder, delays: Delays) -> None:
        self._encoder, self._delays = encoder, delays

    @property
    def encoder_id(self) -> str:
        """See ``Encoder``."""
        return self._encoder.encoder_id

    @property
    def text_space(self) -> str:
        """See ``Encoder``."""
        return self._encoder.text_space

    def encode(self, rgb: U8) -> F16:
        """See ``Encoder``."""
        self._delays.wait("encode_ms")
        return self._encoder.encode(rgb)

    def embed_text(self, texts: Sequence[str]) -> TextEmbeddings:
        """See ``Encoder``."""
        return self._encoder.embed_text(texts)

    def embed_image(self, rgb: U8) -> TextEmbeddings:
        """See ``ImageEncoder``."""
        return self._encoder.embed_image(rgb)


class LateDetector:
    """Implements ``Detector``."""

    def __init__(self, detector: Detector, delays: Delays) -> None:
        self._detector, self._delays = detector, delays

    @property
    def detector_id(self) -> str:
        """See ``Detector``."""
        return self._detector.detector_id

    @property
    def reads_features(self) -> bool:
        """See ``Detector``."""
        return self._detector.reads_features

    def detect(self, image: Image, names: TextEmbeddings) -> tuple[Detection, ...]:
        """See ``Detector``."""
        self._delays.wait("detect_ms")
        return self._detector.detect(image, names)


class LateMethod(PlanningMethod):
    """A method whose steps take time."""

    def __init__(self, method: PlanningMethod, delays: Delays) -> None:
        self._method, self._delays = method, delays

    def begin(self, bus: Bus, search: Search) -> None:
        """See ``PlanningMethod``."""
        self._method.begin(bus, search)

    def seen(self, view: PlanningView) -> PlanningView:
        """See ``PlanningMethod``."""
        return self._method.seen(view)

    def step(self, state: PlannerState, observation: Observation, params: PlannerParams) -> Outcome:
        """See ``PlanningMethod``."""
        outcome = self._method.step(state, observation, params)
        self._delays.wait("plan_ms")
        return outcome
