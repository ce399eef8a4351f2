"""Models of other people: known ones, set up for use."""
