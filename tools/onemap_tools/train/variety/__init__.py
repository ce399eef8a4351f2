"""Variety: apartments with other materials, shapes, strangers and light, to train on."""
