"""The ``onemap`` command: argument parsing, terminal output and reports."""
