"""The network of ``mini`` and its loss."""
