"""Benchmarks: measured on the machine they run on, printed as JSON."""
