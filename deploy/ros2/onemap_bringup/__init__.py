"""Launch file and RViz configuration of OneMap; no code."""
