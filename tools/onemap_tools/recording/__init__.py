"""Recordings of what travels on the bus, in MCAP files, and their replay."""
