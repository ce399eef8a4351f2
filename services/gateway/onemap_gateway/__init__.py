"""OneMap gateway service."""
