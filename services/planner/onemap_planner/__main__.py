"""Run the planner."""

from onemap_planner.config import PlannerConfig
from onemap_planner.service import build
from onemap_shared.runner import run_service

if __name__ == "__main__":
    raise SystemExit(run_service("planner", PlannerConfig, build))
