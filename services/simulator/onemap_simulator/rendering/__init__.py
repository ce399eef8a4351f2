"""RGB, depth and labels of a scene by ray tracing, and the camera that records them."""
