"""What one frame adds to the map: geometry by compiled loops, products by torch."""
