"""What ``onemap bench habitat`` is asked for; imports nothing, the command line reads it."""

from __future__ import annotations

from enum import Enum


class SuccessRule(str, Enum):
    """When a claim is right. paper: stopped less than 1.5 m, seen from above, from the box of an
    instance; habitat: stopped within 0.1 m of way of a view point of an instance."""

    PAPER = "paper"
    HABITAT = "habitat"
