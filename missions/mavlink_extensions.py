"""MAVLink 2 extension fields that PyPI's pymavlink lacks, given to its message classes at run time.

`mission_id` and `opaque_id` are how an autopilot says that its mission has changed; MAVSDK's mission-changed event
fires on exactly them. Extension fields do not enter CRC_EXTRA, so frames stay readable for everybody. This module
knows no MAVLink library: the dialect is handed in.
"""

import struct
from typing import Any

EXTENSIONS: dict[str, tuple[tuple[str, str], ...]] = {
    "MISSION_CURRENT": (
        ("mission_id", "uint32_t"),
        ("fence_id", "uint32_t"),
        ("rally_points_id", "uint32_t"),
    ),
    "MISSION_COUNT": (("opaque_id", "uint32_t"),),
    "MISSION_ACK": (("opaque_id", "uint32_t"),),
}
"""Message -> (field, type) in wire order, from the `common` message set's definition."""

_FORMAT = {"uint32_t": "I", "uint16_t": "H", "uint8_t": "B"}


def add_extension_fields(dialect: Any) -> None:
    """Give the message classes of a pymavlink dialect module the fields of `EXTENSIONS` that they lack.

    Call it once, before the first message is built or parsed; calling it again changes nothing.
    """
    for base in list(dialect.mavlink_map.values()):
        missing = [pair for pair in EXTENSIONS.get(base.msgname, ()) if pair[0] not in base.fieldnames]
        if missing:
            extended = _extended(base, missing)
            dialect.mavlink_map[base.id] = extended
            setattr(dialect, base.__name__, extended)


def _extended(base: Any, fields: list[tuple[str, str]]) -> type[Any]:
    """A subclass of the message class `base` with `fields` appended; they default to 0."""
    names = [name for name, _ in fields]
    old_names: list[str] = list(base.fieldnames)

    def initialise(self: Any, *values: Any, **named: Any) -> None:
        extensions = dict(zip(names, values[len(old_names) :], strict=False))
        extensions |= {name: named.pop(name) for name in names if name in named}
        base.__init__(self, *values[: len(old_names)], **named)
        self._fieldnames = self.fieldnames
        for name in names:
            setattr(self, name, extensions.get(name, 0))

    def pack(self: Any, mav: Any, force_mavlink1: bool = False) -> bytes:
        values = [getattr(self, name) for name in self.ordered_fieldnames]
        return self._pack(mav, self.crc_extra, self.unpacker.pack(*values), force_mavlink1=force_mavlink1)

    layout = base.unpacker.format + "".join(_FORMAT[kind] for _, kind in fields)
    return type(
        base.__name__,
        (base,),
        {
            "fieldnames": old_names + names,
            "ordered_fieldnames": base.ordered_fieldnames + names,
            "fieldtypes": base.fieldtypes + [kind for _, kind in fields],
            "orders": base.orders + list(range(len(old_names), len(old_names) + len(names))),
            "lengths": base.lengths + [1] * len(names),
            "array_lengths": base.array_lengths + [0] * len(names),
            "native_format": bytearray(layout.encode()),
            "unpacker": struct.Struct(layout),
            "__init__": initialise,
            "pack": pack,
        },
    )
