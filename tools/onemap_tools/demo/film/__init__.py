"""A film of a demo: recorded while it searches, drawn and written when it has ended."""
