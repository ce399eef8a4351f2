"""Messages as clients get them."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np

from onemap_gateway.bus.live_state import LiveState
from onemap_gateway.present.views import (
    age_s,
    build_overlay,
    finite,
    found_objects,
    map_archive,
    map_info,
    search_report,
)
from onemap_shared.messages import (
    ObjectResult,
    SearchKind,
    SearchOrder,
    SearchState,
)
from tests.gateway import fakes
from tests.gateway.fakes import STAMP_NS, full_state, search_view


def test_numbers_that_json_lacks_are_null() -> None:
    assert finite(float("nan")) is finite(float("inf")) is None
    assert finite(0.5) == 0.5


def test_an_age_is_never_negative_and_never_of_nothing() -> None:
    assert age_s(STAMP_NS, STAMP_NS + 2_000_000_000) == 2.0
    assert age_s(STAMP_NS + 5, STAMP_NS) == 0.0
    assert age_s(0, STAMP_NS) is None


def test_the_clock_of_a_search_stops_at_its_end() -> None:
    later_ns = STAMP_NS + 60_000_000_000
    assert search_report(fakes.search(), later_ns).elapsed_s == 60
    ended = fakes.search(state=SearchState.FOUND, updated_ns=STAMP_NS + 5_000_000_000)
    assert search_report(ended, later_ns).elapsed_s == 5
    assert search_report(ended, later_ns).target == ""


def test_an_object_that_was_not_found_has_no_place() -> None:
    result = replace(fakes.find_result("sofa", 1, 2), position_m=(), start_xy_m=(), end_xy_m=())
    status = replace(fakes.search(), results=(result,))
    report = search_report(status, STAMP_NS).results[0]
    assert (report.position_m, report.start_xy_m, report.end_xy_m) == (None, None, None)


def test_the_times_of_a_search_lose_nothing_in_javascript() -> None:
    report = search_report(fakes.search(updated_ns=STAMP_NS + 12_400_000_001), STAMP_NS)
    assert report.started_at == "2026-01-01T00:00:00.000Z"
    assert report.updated_at == "2026-01-01T00:00:12.400Z"
    assert report.started_ns == str(STAMP_NS)
    assert report.updated_ns == "1767225612400000001"


def test_lengths_are_rounded_to_millimetres() -> None:
    result = replace(
        fakes.find_result("sofa", float(np.float32(2.35)), -1.10004), path_length_m=3.14159
    )
    status = replace(fakes.search(), results=(result,), path_length_m=2.71828)
    report = search_report(status, STAMP_NS)
    assert report.path_length_m == 2.718
    assert report.results[0].position_m == (2.35, -1.1, 0.4)
    assert report.results[0].end_xy_m == (2.35, -1.1)
    assert report.results[0].path_length_m == 3.142


def test_areas_are_square_metres() -> None:
    info = map_info(search_view(), fakes.revision(7), STAMP_NS)
    assert np.isclose(info.free_m2, 3.0)
    assert np.isclose(info.occupied_m2, 0.15)
    assert np.isclose(info.observed_m2, 3.15)
    assert info.frames_fused == 7
    assert map_info(search_view(), None, STAMP_NS).encoder_id == ""


def test_the_archive_needs_no_pickle_and_keeps_every_value() -> None:
    view = search_view("sofa")
    with np.load(io.BytesIO(map_archive(view)), allow_pickle=False) as archive:
        np.testing.assert_array_equal(archive["occupancy"], view.occupancy)
        np.testing.assert_array_equal(archive["layers"], view.layers)
        np.testing.assert_array_equal(archive["similarity"], view.similarity)
        np.testing.assert_allclose(archive["origin_m"], (-1.0, -0.5))
        assert float(archive["cell_size_m"]) == 0.1
        assert int(archive["revision"]) == 7
        assert int(archive["stamp_ns"]) == STAMP_NS
        assert str(archive["text"]) == "sofa"


def test_an_overlay_holds_what_the_state_has() -> None:
    overlay = build_overlay(full_state(), 1.0)
    np.testing.assert_allclose(overlay.robot, (1.0, 2.0, 0.5))
    np.testing.assert_allclose(overlay.path_m, [(1, 2), (3, 4)])
    assert overlay.found == (("sofa", 1.0, 2.0),)
    assert len(overlay.frontiers_m) == 1


def test_an_overlay_of_nothing_is_empty() -> None:
    overlay = build_overlay(LiveState(), 0.0)
    assert not overlay.robot
    assert not overlay.found
    assert len(overlay.path_m) == len(overlay.trail_m) == 0


def test_a_drive_has_a_place_and_a_result_without_name_and_object() -> None:
    here = (1.02, -2.49)
    result = ObjectResult("", SearchState.ARRIVED, "there", (), 0.0, 9.0, 4.0, (0.0, 0.0), here)
    status = replace(
        fakes.search(state=SearchState.ARRIVED, objects=()),
        kind=SearchKind.GO_TO,
        place_m=(1.0, -2.5),
        results=(result,),
    )
    report = search_report(status, STAMP_NS)
    assert (report.kind, report.place_m, report.objects) == (SearchKind.GO_TO, (1.0, -2.5), ())
    (shown,) = report.results
    assert (shown.name, shown.outcome, shown.position_m) == ("", SearchState.ARRIVED, None)
    assert shown.end_xy_m == here
    assert found_objects(status) == ()


def test_results_are_in_the_order_of_the_request() -> None:
    results = tuple(
        ObjectResult(name, SearchState.FOUND, "", (1.0, 2.0, 0.5), 0.9, seconds, 1.0, (), ())
        for name, seconds in (("bed", 3.0), ("cup", 4.0))
    )
    status = replace(
        fakes.search(objects=("cup", "sofa", "bed")), order=SearchOrder.ANY, results=results
    )
    report = search_report(status, STAMP_NS)
    assert [(each.name, each.duration_s) for each in report.results] == [("cup", 4.0), ("bed", 3.0)]
    assert report.order is SearchOrder.ANY
