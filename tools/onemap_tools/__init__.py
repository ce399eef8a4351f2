"""Command line, launcher, doctor, benchmarks and training."""
