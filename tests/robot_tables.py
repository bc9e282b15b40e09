"""Tables of shipped robot files, and changes to them, that tests of the loader share."""

from __future__ import annotations

import tomllib

from kr16cli.assets import asset

SHIPPED = ("kr16_2", "chapter3", "kr16_l6")
MISSING = object()


def shipped_table(name="kr16_2"):
    return tomllib.loads(asset(f"data/{name}.toml").read_text(encoding="utf-8"))


def put(table, way, value):
    """Set, or with MISSING remove, what the way of keys and indices leads to."""
    *parents, last = way
    for step in parents:
        table = table[step]
    if value is MISSING:
        del table[last]
    else:
        table[last] = value


def changed(way, value, name="kr16_2"):
    table = shipped_table(name)
    put(table, way, value)
    return table


def leaves(node, way=()):
    """Every (way, value) below a node that is no table and no list."""
    if isinstance(node, dict | list):
        steps = node.items() if isinstance(node, dict) else enumerate(node)
        for step, below in steps:
            yield from leaves(below, (*way, step))
    else:
        yield way, node
