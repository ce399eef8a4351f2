"""What two or more OneMap services share: geometry, grids, messages, the bus, configuration, the runner."""
