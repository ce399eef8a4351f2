"""Designs: named things built in other ways than the simulator's furniture, to train on."""
