"""Frames and fields over emulated links, between real processes."""
