"""The configuration of a robot's services, as one value."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from onemap_mapper.config import MapperConfig
from onemap_perception.config import PerceptionConfig
from onemap_planner.config import PlannerConfig
from onemap_shared.config import read, section
from onemap_simulator.config import SimulatorConfig


@dataclass(frozen=True, slots=True)
class SystemConfig:
    """The sections of the configuration that determine a search."""

    simulator: SimulatorConfig = field(default_factory=SimulatorConfig)
    perception: PerceptionConfig = field(default_factory=PerceptionConfig)
    mapper: MapperConfig = field(default_factory=MapperConfig)
    planner: PlannerConfig = field(default_factory=PlannerConfig)

    @classmethod
    def read(cls, config: Path | None, **simulator: Any) -> SystemConfig:
        """The sections of a configuration file, with these settings of the simulator."""
        sections = read(config)
        robot = {**sections.get("simulator", {}), **simulator}
        return cls(
            section({"simulator": robot}, "simulator", SimulatorConfig),
            section(sections, "perception", PerceptionConfig),
            section(sections, "mapper", MapperConfig),
            section(sections, "planner", PlannerConfig),
        )

    def document(self) -> dict[str, Any]:
        """As a JSON object."""
        return {name: getattr(self, name).model_dump(mode="json") for name in self.__slots__}

    def searching(self, *, rgbd_hz: float, limit_s: float, **simulator: Any) -> SystemConfig:
        """The same at a rate of frames and with simulated seconds per object."""
        explore = self.planner.explore.model_copy(update={"object_limit_s": limit_s})
        return replace(
            self,
            simulator=self.simulator.model_copy(update={"rgbd_hz": rgbd_hz, **simulator}),
            planner=self.planner.model_copy(update={"explore": explore}),
        )
