"""Encoders: images and texts to one feature space."""
