"""A test set that no training has seen: other shapes, textures, apartments and another renderer.

Nothing here may be imported by training code, and no value may be chosen by its figures.
"""
