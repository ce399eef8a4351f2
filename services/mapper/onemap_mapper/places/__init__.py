"""Places: rooms, cut from the floor."""
