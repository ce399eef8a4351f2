"""Training of the encoder ``mini``: render, train, evaluate, export."""
