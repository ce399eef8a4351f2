"""Diagnosis of depth, floor and frame flow: sentences and metrics for the heartbeat."""
