"""Furniture and small things: each function draws one model of its category."""
