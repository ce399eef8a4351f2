"""What the robot sees, knows and plans, for viewers of others: Foxglove and Rerun."""
