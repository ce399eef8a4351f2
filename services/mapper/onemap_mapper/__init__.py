"""OneMap mapper service."""
