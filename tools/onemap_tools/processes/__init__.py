"""Start, supervise and check service processes on this machine."""
