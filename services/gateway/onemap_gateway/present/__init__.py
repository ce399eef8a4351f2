"""Pure functions from bus messages to images, documents and metrics."""
