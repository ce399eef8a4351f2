"""Loops over pixels and cells, compiled; beside each stands what it replaces, in torch or numpy."""
