"""What services share: geometry, grids, messages, the bus, configuration, the runner."""
