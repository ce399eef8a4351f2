"""What is searched for and how it stands: phases, events, transitions, journal."""
