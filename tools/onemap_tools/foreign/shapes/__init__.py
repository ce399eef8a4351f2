"""Classes of the foreign test set, eight shapes each."""
