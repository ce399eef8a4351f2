"""Multi-object navigation in generated apartments, in simulated time."""
