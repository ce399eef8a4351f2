"""Queries from text: embeddings, vocabulary and scores."""
