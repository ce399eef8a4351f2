"""What the map offers: window, costmap, frontiers, regions, object candidates."""
