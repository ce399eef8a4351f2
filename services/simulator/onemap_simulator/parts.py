"""The parts of a simulated robot, as its configuration says."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from onemap_shared.messages import RgbdFrame
from onemap_simulator.config import SimulatorConfig
from onemap_simulator.errors import ERRORS, FrameLink, Localisation
from onemap_simulator.ground_truth.truth import SceneTruth
from onemap_simulator.physics.collision import CollisionMap, MissingFloor
from onemap_simulator.physics.people import People
from onemap_simulator.physics.robot import RobotState
from onemap_simulator.physics.simulation import Simulation
from onemap_simulator.rendering.rgbd_camera import RgbdCamera, SceneRenderer
from onemap_simulator.scene.scene import Scene


@dataclass(frozen=True, slots=True)
class RobotParts:
    """Physics, camera, what the robot believes of its place, and the link that takes its frames."""

    simulation: Simulation
    camera: RgbdCamera
    localisation: Localisation
    link: FrameLink[RgbdFrame]

    @classmethod
    def of(
        cls, scene: Scene, config: SimulatorConfig, renderer: SceneRenderer, *, now_s: float
    ) -> RobotParts:
        """A robot at the start of the scene at ``now_s``.

        Each part has random numbers of its own, drawn by ``config.seed``: what one takes changes
        nothing for the others.
        """
        # The second is for nobody: the published figures are drawn with this order.
        rngs = np.random.default_rng(config.seed).spawn(5)
        camera_rng, _, drift_rng, link_rng, people_rng = rngs
        robot, errors = config.robot, ERRORS[config.errors]
        simulation = Simulation(
            CollisionMap.of(scene, robot.height_m),
            robot,
            RobotState(*scene.start),
            now_s=now_s,
            missing_floor=MissingFloor.of(scene, robot.height_m),
            people=People.of(scene, errors.people, people_rng, robot_radius_m=robot.radius_m),
        )
        camera = RgbdCamera(scene, renderer, config.camera, camera_rng, errors.depth)
        localisation = Localisation(errors, drift_rng)
        return cls(simulation, camera, localisation, FrameLink(errors.link, link_rng))


def scene_truth(scene: Scene, config: SimulatorConfig) -> SceneTruth:
    """The ground truth of a scene for the configured robot and camera."""
    return SceneTruth(
        scene,
        radius_m=config.robot.radius_m,
        height_m=config.robot.height_m,
        eye_height_m=config.camera.height_m,
    )
