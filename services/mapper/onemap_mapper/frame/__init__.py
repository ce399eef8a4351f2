"""What one frame adds to the map: compiled loops and torch side by side."""
