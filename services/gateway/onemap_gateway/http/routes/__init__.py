"""The HTTP interface, one subject per file."""
