"""How to get there: paths, tracking, velocity control, progress and staleness checks."""
