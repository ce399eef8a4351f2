"""Free and occupied cells from depth: evidence, floor, edges, heights."""
