"""How the search for an object ended, as clients get it: code, coverage, evidence."""

from __future__ import annotations

from pydantic import BaseModel, Field

from onemap_gateway.present.formats import DECIMALS, millimetres
from onemap_shared.messages import ObjectResult, SearchState


class CoverageReport(BaseModel):
    """What a search that found nothing has looked at."""

    explored_m2: float = Field(description="Free floor that was seen well enough.")
    free_m2: float = Field(description="Free floor that was seen at all.")
    unreachable_m2: float = Field(description="Free floor that no way leads to.")
    best_match_m: tuple[float, float] | None = Field(
        description="x, y of where the map resembles the object most; null without features."
    )
    best_score: float = Field(description="Similarity there, 0 to 1.")


class EvidenceReport(BaseModel):
    """In what an object was seen; its picture is at `/v1/objects/{id}.jpg`."""

    frame_ns: str = Field(description="Capture time of the frame; a string, as all nanoseconds.")
    box_px: tuple[float, float, float, float] | None = Field(
        description="x_min, y_min, x_max, y_max in that frame; null if there is none."
    )
    cells: int = Field(description="Cells of the map that support it.")


def coverage_report(result: ObjectResult) -> CoverageReport | None:
    """The coverage of an object that was not found; None of others."""
    if result.outcome is not SearchState.NOT_FOUND:
        return None
    coverage = result.coverage
    return CoverageReport(
        explored_m2=round(coverage.explored_m2, DECIMALS),
        free_m2=round(coverage.free_m2, DECIMALS),
        unreachable_m2=round(coverage.unreachable_m2, DECIMALS),
        best_match_m=millimetres(coverage.best_match_m) or None,
        best_score=round(coverage.best_score, DECIMALS),
    )


def evidence_report(result: ObjectResult) -> EvidenceReport | None:
    """In what an object was found; None of others."""
    if result.outcome is not SearchState.FOUND:
        return None
    return EvidenceReport(
        frame_ns=str(result.frame_ns), box_px=millimetres(result.box_px) or None, cells=result.cells
    )
