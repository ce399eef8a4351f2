"""``onemap demo``: one simulated search with a summary."""
