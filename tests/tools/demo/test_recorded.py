"""A recording that is played to its end, or to the time limit, and then asked."""

from __future__ import annotations

import json
from typing import Any

import httpx

from onemap import Client
from onemap_tools.demo.recorded import lines, play


class FakeGateway:
    """A gateway whose replay had played 7 frames before; the mapper is two frames behind."""

    def __init__(self) -> None:
        self.played = 7
        self.asked_at: list[int] = []

    def handle(self, request: httpx.Request) -> httpx.Response:
        if request.url.path.endswith("/queries"):
            texts = json.loads(request.content)["texts"]
            if "blorp" in texts:
                return httpx.Response(422, json={"detail": "'blorp' is no word that mini knows."})
            self.asked_at.append(self.played)
            best = {"rank": 1, "centre_m": [1.0, 2.0], "extent_m": [0, 0, 2, 3], "score": 0.8}
            found = {"verdict": "found", "sentence": "It is on the map.", "regions": [best]}
            none = {"verdict": "not_here", "sentence": "It is not here.", "regions": []}
            answers = [{"text": t, **(found if t == "sofa" else none)} for t in texts]
            return httpx.Response(200, json={"answers": answers})
        if request.url.path == "/v1/status":
            frames = {"frames_recorded": 5, "frames_skipped": 2, "frames_unreadable": 1}
            replay = {"frames_played": self.played - 1, "frames_lost": 2, **frames}
            mapper = {"floor_height_m": 0.31}
            services = [
                {"name": name, "condition": "ok", "problem": "", "metrics": metrics}
                for name, metrics in (("replay", replay), ("mapper", mapper))
            ]
            return httpx.Response(200, json={"services": services})
        numbers = dict.fromkeys(("free_m2", "occupied_m2", "observed_m2"), 1.0)
        document = {"revision": 1, "age_s": 0.1, "bounds_m": [0, 0, 1, 1], **numbers}
        return httpx.Response(200, json={**document, "frames_fused": self.played - 2})

    def play(self, objects: tuple[str, ...], limit: int = 100) -> dict[str, Any]:
        def pause() -> None:
            self.played += 1

        client = Client(transport=httpx.MockTransport(self.handle))
        return play(client, objects, pause, lambda: self.played >= limit)


def test_every_frame_is_played_before_the_objects_are_asked_for() -> None:
    gateway = FakeGateway()
    document = gateway.play(("sofa", "bed"))
    assert gateway.asked_at == [7, 15]  # 5 frames, and 3 more until the last of them is fused
    assert (document["worked"], document["trouble"]) == (True, "")
    assert (document["frames"], document["frames_skipped"], document["frames_fused"]) == (5, 2, 13)
    assert [answer["verdict"] for answer in document["answers"]] == ["found", "not_here"]
    assert document["answers"][0]["position_m"] == [1.0, 2.0]
    told = lines(document)
    assert told[0].endswith("1 not readable, 2 lost on the way.")
    assert "z = +0.31 m" in told[2]
    assert told[3:] == ["sofa: It is on the map. Best at (1.0, 2.0).", "bed: It is not here."]


def test_the_time_limit_ends_a_long_recording() -> None:
    document = FakeGateway().play((), limit=9)
    assert document["worked"] is False
    assert document["trouble"] == "Only 2 of 5 frames were played within the time limit."
    assert lines(document)[-1] == document["trouble"]
