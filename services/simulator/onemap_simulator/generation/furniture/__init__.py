"""Furniture and small objects: each function generates one random model of its category."""
