"""``onemap models use``: from the name of a model to a configuration that runs it."""
