"""Faults drawn by seed, in virtual time: what happens to a robot's services, and what must hold."""
