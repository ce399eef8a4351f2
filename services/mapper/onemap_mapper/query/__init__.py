"""Answers about the map: similarity, regions, verdicts."""
