"""What to do next: goals, viewpoints, verification, and the planning step over them."""
