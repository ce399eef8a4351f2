"""Attacks on the running system: ``make chaos``. Not part of ``make test``."""
