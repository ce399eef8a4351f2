"""Figures of the trained encoder, and the model card."""
