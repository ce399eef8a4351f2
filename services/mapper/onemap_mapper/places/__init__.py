"""Places: rooms, cut from the floor, and what people named."""
