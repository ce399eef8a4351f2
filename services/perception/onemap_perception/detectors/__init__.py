"""Detectors: where in a picture is a thing of this name."""
