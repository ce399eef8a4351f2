"""Detectors: where in an image is a thing of this name."""
