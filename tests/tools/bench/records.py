"""Hand-made records for the tests of the benchmark."""

from __future__ import annotations

from onemap_tools.bench.navigation.records import EpisodeRecord, Failure, ObjectRecord


def found(name: str, shortest_m: float, driven_m: float) -> ObjectRecord:
    return ObjectRecord(
        name=name,
        outcome="found",
        reason="",
        success=True,
        claimed_wrongly=False,
        spl=shortest_m / max(shortest_m, driven_m),
        path_length_m=driven_m,
        shortest_path_m=shortest_m,
        goal_distance_m=0.0,
        time_s=10.0,
        in_view=5,
        detected=3,
        failure=Failure.NONE,
    )


def failed(name: str, driven_m: float, failure: Failure) -> ObjectRecord:
    wrong = failure is Failure.WRONG_OBJECT
    return ObjectRecord(
        name=name,
        outcome="found" if wrong else "not_found",
        reason="",
        success=False,
        claimed_wrongly=wrong,
        spl=0.0,
        path_length_m=driven_m,
        shortest_path_m=2.0,
        goal_distance_m=None,
        time_s=30.0,
        in_view=0,
        detected=0,
        failure=failure,
    )


def episode(index: int, *objects: ObjectRecord, contacts: int = 0) -> EpisodeRecord:
    return EpisodeRecord(
        index=index,
        seed=index + 1,
        start=(1.0, 2.0, 0.5),
        objects=objects,
        contacts=contacts,
        simulated_s=sum(item.time_s for item in objects),
        trajectory=((1.0, 2.0), (1.5, 2.25)),
        wall_s=1.0,
    )
