"""``onemap doctor``: observe the bus and diagnose faults."""
