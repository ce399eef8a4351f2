"""From the names of nodes in a file to categories: ``Sofa-01`` is a sofa."""

from __future__ import annotations

import re

UNNAMED = "object"

# What exporters call things that nobody named.
_ANONYMOUS = frozenset({"", "geometry", "mesh", "node", "object", "scene", "world", "default"})
_CAMEL = re.compile(r"(?<=[a-z])(?=[A-Z])")
_COUNTER = re.compile(r"[\s_.\-]*\d+$")
_SEPARATORS = re.compile(r"[\s_.\-]+")


def category_of(name: str) -> str:
    """The category in a node's name: counters dropped, separators to spaces, lower case.

    ``sofa_2``, ``sofa.003`` and ``Sofa-01`` are "sofa", ``coffee_table_1`` and ``CoffeeTable``
    are "coffee table"; a name that says nothing, as ``geometry_0``, is "object".
    """
    text = _CAMEL.sub(" ", name.strip())
    while _COUNTER.search(text):
        text = _COUNTER.sub("", text)
    text = _SEPARATORS.sub(" ", text).strip().lower()
    return UNNAMED if text in _ANONYMOUS else text
