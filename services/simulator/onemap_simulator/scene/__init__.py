"""Scenes: triangles with named objects, and how they are read from files."""
