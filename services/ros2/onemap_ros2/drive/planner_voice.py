"""What the planner said last, and whether a goal of nav2 may rest on it."""

from __future__ import annotations

from dataclasses import dataclass, replace

from onemap_ros2.config import Nav2Params
from onemap_ros2.drive.goal_pose import GoalPose, goal_of
from onemap_shared.messages import PlannedPath, SearchStatus

NEVER = float("-inf")


@dataclass(frozen=True, slots=True)
class PlannerVoice:
    """The planner's newest messages, with their times of arrival in seconds.

    Attributes:
        path: the newest plan of this search; None before its first.
        path_s: when it came.
        command_s: when the newest velocity came.
        search: the id of the active search; empty without one.
    """

    path: PlannedPath | None = None
    path_s: float = NEVER
    command_s: float = NEVER
    search: str = ""

    def with_path(self, path: PlannedPath, now_s: float) -> PlannerVoice:
        """After a plan came."""
        return replace(self, path=path, path_s=now_s)

    def with_status(self, status: SearchStatus) -> PlannerVoice:
        """After the state of the search came; the plan of another search counts no more."""
        search = status.search_id if status.active else ""
        if search == self.search:
            return self
        return replace(self, search=search, path=None, path_s=NEVER)

    def with_command(self, now_s: float) -> PlannerVoice:
        """After a velocity came."""
        return replace(self, command_s=now_s)

    def goal(self, now_s: float, robot: GoalPose, params: Nav2Params) -> GoalPose | None:
        """Where the robot is to drive; None: it must not drive on.

        It must not without an active search, a recent plan and a recent velocity: the planner
        sends no plan while its map or its odometry is too old.
        """
        recent = (
            now_s - self.path_s <= params.max_plan_age_s
            and now_s - self.command_s <= params.max_command_age_s
        )
        if not self.search or self.path is None or not recent:
            return None
        return goal_of(self.path, robot)
