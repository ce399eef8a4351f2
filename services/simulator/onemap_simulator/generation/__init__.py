"""Procedural apartments: floor plan, structure, furniture, textures."""
