"""What a program holds: every container that can be reached from an object, and how much is in it."""

from collections import deque
from collections.abc import Collection, Iterator, Mapping
from itertools import islice
from typing import Any

PROGRAMS = ("gcs", "companion", "sitl", "missions")
LOOKED_INTO = 1000
"""Of a container that is too large, more need not be looked at."""


def crowds(roots: Mapping[str, object], most: int) -> Iterator[tuple[str, int]]:
    """Where more than `most` things are kept, and how many: path and number.

    Only our own programs' objects, and containers in them, are followed; arrays are of a size that was chosen, and so
    are queues with a limit.
    """
    seen: set[int] = set()
    waiting = list(roots.items())
    while waiting:
        path, thing = waiting.pop()
        if id(thing) in seen:
            continue
        seen.add(id(thing))
        if isinstance(thing, dict | list | tuple | set | frozenset | deque):
            kept: Collection[Any] = thing.values() if isinstance(thing, dict) else thing
            if len(kept) > most and getattr(thing, "maxlen", None) is None:
                yield path, len(kept)
            waiting.extend((f"{path}[]", part) for part in islice(kept, LOOKED_INTO))
        elif any(kind.__module__.split(".")[0] in PROGRAMS for kind in type(thing).__mro__):
            waiting.extend((f"{path}.{name}", part) for name, part in _attributes(thing))


def _attributes(thing: object) -> Iterator[tuple[str, object]]:
    yield from getattr(thing, "__dict__", {}).items()
    for kind in type(thing).__mro__:
        slots = kind.__dict__.get("__slots__", ())
        for name in (slots,) if isinstance(slots, str) else slots:
            if hasattr(thing, name):
                yield name, getattr(thing, name)
    for name in getattr(thing, "__struct_fields__", ()):
        yield name, getattr(thing, name)
