"""The map in formats of other programs."""
