"""OneMap simulator service."""
