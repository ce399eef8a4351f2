"""OneMap planner service."""
