"""Vehicles chosen by a line of text: names, system ids and ranges of them; pure."""

from collections.abc import Mapping

from gcs.errors import UsageError


def choose(text: str, names: Mapping[int, str]) -> list[int]:
    """System ids of the vehicles that a text such as `alpha, 3, 5-9` names.

    Args:
        text: what was typed.
        names: of all vehicles, by system id.

    Raises:
        UsageError: a part of the text names no vehicle.

    Example:
        >>> choose("bravo, 3-4", {1: "alpha", 2: "bravo", 3: "charlie", 4: "delta"})
        [2, 3, 4]
    """
    by_name = {name.lower(): sysid for sysid, name in names.items()}
    chosen: set[int] = set()
    for part in filter(None, (piece.strip().lower() for piece in text.split(","))):
        first, dash, last = part.partition("-")
        if part in by_name:
            chosen.add(by_name[part])
        elif first.strip().isdecimal() and (last.strip().isdecimal() or not dash):
            low, high = int(first), int(last or first)
            chosen |= {sysid for sysid in names if low <= sysid <= high}
        else:
            raise UsageError(f"{part!r} names no vehicle: expected names, system ids or ranges such as 3-5")
    return sorted(chosen)
