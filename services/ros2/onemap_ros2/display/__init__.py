"""What RViz and Foxglove show: the map, finds, regions, frontiers, the goal."""
