"""OneMap perception service."""
