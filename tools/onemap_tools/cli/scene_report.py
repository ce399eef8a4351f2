"""Runs ``onemap scene check``: inspect a scene file, report what the simulator reads."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict
from math import degrees
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table

from onemap_simulator.inspection import SceneInspection, inspect_scene
from onemap_simulator.physics.robot import RobotParams
from onemap_tools.errors import EXIT_USAGE_ERROR, CliError

LISTED = 3  # nodes of a category that are named in the table


def examine(file: Path) -> SceneInspection:
    """Inspect a scene file as the simulator reads it; CliError if it is not a scene."""
    robot = RobotParams()
    try:
        return inspect_scene(file, radius_m=robot.radius_m, height_m=robot.height_m)
    except ValueError as problem:
        raise CliError(str(problem), EXIT_USAGE_ERROR) from problem


def draw(inspection: SceneInspection, file: Path) -> Path | None:
    """Write the floor plan; returns its path, None if the scene is too large for one."""
    from onemap_tools.cli.floor_plan import draw_floor_plan, write_png

    if inspection.floor is None:
        return None
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_png(file, draw_floor_plan(inspection.scene, inspection.floor, inspection.start))
    except OSError as problem:
        reason = problem.strerror or problem
        raise CliError(f"Cannot write the picture {file}: {reason}.") from problem
    return file


def document(inspection: SceneInspection, picture: Path | None) -> dict[str, Any]:
    """As a JSON object; lengths in metres, areas in square metres, angles in radians."""
    low, high = inspection.extent_m
    start = inspection.start
    return {
        "searchable": inspection.searchable,
        "name": inspection.scene.name,
        "nodes": [asdict(node) for node in inspection.nodes],
        "categories": list(inspection.scene.categories),
        "triangles": len(inspection.scene.faces),
        "up": inspection.up,
        "up_reason": inspection.up_reason,
        "extent_m": [[round(v, 4) for v in low], [round(v, 4) for v in high]],
        "floor_m": round(inspection.floor_m, 4),
        "start": [round(value, 4) for value in start] if start else None,
        "start_from_yaml": inspection.start_from_yaml,
        "reachable_m2": round(inspection.floor.reachable_m2, 2) if inspection.floor else None,
        "warnings": list(inspection.warnings),
        "problems": list(inspection.problems),
        "picture": str(picture) if picture else None,
    }


def describe(inspection: SceneInspection, picture: Path | None, console: Console) -> None:
    """Print categories, size, start, warnings, problems and the verdict."""
    titles = ("category", "nodes", "triangles", "named by", "which")
    table = Table(*titles, box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for category in inspection.scene.categories:
        nodes = [node for node in inspection.nodes if node.category == category]
        by_yaml = sum(node.from_yaml for node in nodes)
        names = ", ".join(node.name for node in nodes[:LISTED])
        table.add_row(
            category,
            str(len(nodes)),
            str(sum(node.triangles for node in nodes)),
            {0: "file", len(nodes): "YAML"}.get(by_yaml, "both"),
            names + (", ..." if len(nodes) > LISTED else ""),
        )
    console.print(table)
    for line in _facts(inspection):
        console.print(line)
    if picture:
        console.print(f"Floor plan: {picture}", soft_wrap=True)
    for warning in inspection.warnings:
        console.print(f"Warning: {warning}", style="yellow")
    for problem in inspection.problems:
        console.print(problem, style="red")
    verdict = "A robot can search here." if inspection.searchable else "No robot can search here."
    console.print(verdict, style="green" if inspection.searchable else "red")


def _facts(inspection: SceneInspection) -> Iterable[str]:
    low, high = inspection.extent_m
    size = " x ".join(f"{b - a:.2f}" for a, b in zip(low, high, strict=True))
    yield f"Up axis: {inspection.up} ({inspection.up_reason})"
    yield f"Size: {size} m (x, y, height), {len(inspection.scene.faces)} triangles"
    yield f"Floor: at {inspection.floor_m:.2f} m of the file's height, taken as 0"
    if inspection.start:
        x, y, yaw = inspection.start
        chosen = "from the YAML" if inspection.start_from_yaml else "the roomiest place"
        yield f"Start: ({x:.2f}, {y:.2f}) m, facing {degrees(yaw):.0f} degrees, {chosen}"
    if inspection.floor:
        yield f"Floor the robot can reach: {inspection.floor.reachable_m2:.1f} m2"
