"""The map: cells, features, tiles, views."""
