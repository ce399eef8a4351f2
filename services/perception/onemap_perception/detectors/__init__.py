"""Detectors: objects of given names in an image."""
