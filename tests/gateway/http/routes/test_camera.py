"""/v1/camera.jpg."""

from __future__ import annotations

import numpy as np
from starlette.testclient import TestClient

from onemap_gateway.present.render import BOX
from onemap_shared import keys
from onemap_shared.memory_bus import MemoryRouter
from tests.gateway import fakes
from tests.gateway.fakes import client_of, decoded, gateway_on, state_reached


def test_the_camera_shows_the_newest_image_with_its_detections(router: MemoryRouter) -> None:
    robot = router.bus("simulator")
    with gateway_on(router) as gateway:
        robot.publish(keys.ROBOT_RGBD).put(fakes.rgbd(5))
        robot.publish(keys.DETECTIONS).put(fakes.detections("sofa", sequence=5))
        assert state_reached(gateway.cache, lambda s: bool(s.frame and s.detections))
        client = client_of(gateway)
        drawn = client.get("/v1/camera.jpg")
        plain = client.get("/v1/camera.jpg?detections=false")
    assert drawn.headers["X-OneMap-Sequence"] == "5"
    assert decoded(plain.content).shape == (24, 32, 3)
    edge = (slice(17, 20), 4)  # rows and column of the corner of the box below its label
    np.testing.assert_allclose(decoded(drawn.content)[edge].mean(axis=0), BOX, atol=60)
    np.testing.assert_allclose(decoded(plain.content)[edge].mean(axis=0), (200, 0, 0), atol=30)


def test_without_a_camera_the_robot_is_missing(client: TestClient) -> None:
    answer = client.get("/v1/camera.jpg")
    assert answer.status_code == 503
    assert answer.json()["service"] == "robot"
