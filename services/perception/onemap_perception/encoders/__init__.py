"""Encoders: images and words to one feature space."""
