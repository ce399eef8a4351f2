"""Runs many seeds, and makes the plans that fail as small as they can be."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from typing import Any

from onemap_tools.bench.faults.plan import FaultPlan, drawn, shrunk
from onemap_tools.bench.faults.run import RunResult, run_plan
from onemap_tools.bench.options import FaultsBench
from onemap_tools.processes.worker_pool import worker_pool


def run(options: FaultsBench, say: Callable[[str], object]) -> dict[str, Any]:
    """The seeds that failed, with the rule and the smallest plan of each; figures of all."""
    began_s = time.monotonic()
    seeds = range(options.seed, options.seed + options.seeds)
    with worker_pool(options.workers) as pool:
        judged = pool.map(_judged, seeds)
        results: list[dict[str, Any]] = []
        for result in judged:
            results.append(result)
            for each in result["broken"]:
                say(f"seed {result['seed']}, rule {each['rule']}: {each['what']}")
                say(f"  {json.dumps(result['plan'])}")
    broken = [result for result in results if result["broken"]]
    wall_s = time.monotonic() - began_s
    return {
        "seeds": len(results),
        "first_seed": options.seed,
        "broken": broken,
        "virtual_s": round(sum(result["virtual_s"] for result in results), 1),
        "driven_m": round(sum(result["metres"] for result in results), 1),
        "searches": sum(result["searches"] for result in results),
        "trace": sum(result["trace"] for result in results) % 2**32,
        "wall_s": round(wall_s, 1),
    }


def lines(result: dict[str, Any]) -> list[str]:
    """The figures; what failed was said."""
    return [f"{name:12} {value}" for name, value in result.items() if name != "broken"]


def _judged(seed: int) -> dict[str, Any]:
    logging.disable(logging.CRITICAL)  # services say a lot while they are broken
    plan = drawn(seed)
    found = run_plan(plan)
    if found.broken:
        rule = found.broken[0].rule
        plan = shrunk(plan, partial(_breaks, rule))
    return {"seed": seed, "plan": asdict(plan), **_figures(found)}


def _breaks(rule: str, plan: FaultPlan) -> bool:
    return any(each.rule == rule for each in run_plan(plan).broken)


def _figures(found: RunResult) -> dict[str, Any]:
    return {**asdict(found), "broken": [asdict(each) for each in found.broken]}
