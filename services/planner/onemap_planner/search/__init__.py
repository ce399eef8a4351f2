"""State of a search: phases, events, transitions, record."""
