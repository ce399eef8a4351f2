"""Attacks: all of them are ``make chaos``, those marked ``slow`` part of ``make test`` too."""
