"""One vehicle's parameters: stored values, the values that are applied, and their bytewise MAVLink encoding."""

import math
import struct
import zlib
from collections.abc import Callable, Iterable

from sitl.autopilot.parameter_table import Parameter

MAV_PARAM_TYPE_UINT32 = 5
MAV_PARAM_TYPE_INT32 = 6
MAV_PARAM_TYPE_REAL32 = 9

LOSS_TIMEOUTS = ("COM_OF_LOSS_T", "COM_DL_LOSS_T", "COM_OBC_LOSS_T", "COM_RC_LOSS_T")
"""Timeouts of the wall clock: with a speed factor they are longer in simulated time."""


class Parameters:
    """The parameters of one vehicle.

    Args:
        table: what there is, sorted by name.
        speed: simulated seconds per wall-clock second; the loss timeouts grow with it.
        on_change: called with a name whose value has changed, and once per name at the start.
        kept: values from before this boot; what is set is put into it.
    """

    def __init__(
        self,
        table: Iterable[Parameter],
        speed: float,
        on_change: Callable[[str, float], None],
        kept: dict[str, float | int] | None = None,
    ) -> None:
        self._table = {parameter.name: parameter for parameter in table}
        self._stored = {parameter.name: _as_stored(parameter.default) for parameter in self._table.values()}
        self._kept = {} if kept is None else kept
        self._stored.update({name: value for name, value in self._kept.items() if name in self._table})
        self._speed = speed
        self._on_change = on_change
        self._applied: dict[str, float] = {}
        self.names = tuple(self._table)
        for name in self.names:
            self._apply(name)

    def __getitem__(self, name: str) -> float:
        """The value that is applied: within its range, timeouts in simulated seconds."""
        return self._applied[name]

    def __contains__(self, name: str) -> bool:
        return name in self._table

    def stored(self, name: str) -> float | int:
        """The value as it was set."""
        return self._stored[name]

    def is_int(self, name: str) -> bool:
        return isinstance(self._table[name].default, int)

    def set(self, name: str, value: float | int) -> bool:
        """Store a finite value of the parameter's own type; returns whether it is another one than before."""
        changed = value != self._stored[name]
        self._stored[name] = value
        if changed:
            self._kept[name] = value
            self._apply(name)
        return changed

    def reset(self) -> None:
        """Every parameter gets its default back."""
        for name, parameter in self._table.items():
            self.set(name, _as_stored(parameter.default))
        self._kept.clear()

    def encoded(self, name: str) -> tuple[bytes, int]:
        """The four bytes of a PARAM_VALUE's `param_value`, and its `param_type`; integers take the float's place."""
        kind = MAV_PARAM_TYPE_INT32 if self.is_int(name) else MAV_PARAM_TYPE_REAL32
        return self._bytes(name), kind

    def decoded(self, name: str, raw: bytes, param_type: int) -> float | int | None:
        """What the four bytes of a PARAM_SET mean for this parameter; None if the type is wrong or it is not finite."""
        if self.is_int(name):
            return struct.unpack("<i", raw)[0] if param_type == MAV_PARAM_TYPE_INT32 else None
        value = struct.unpack("<f", raw)[0]
        return value if param_type == MAV_PARAM_TYPE_REAL32 and math.isfinite(value) else None

    def hash_check(self) -> tuple[bytes, int]:
        """The same for `_HASH_CHECK`: a CRC-32 over all names and values, as PX4 and QGroundControl form it."""
        crc = 0
        for name in self.names:
            crc = _crc32_part(self._bytes(name), _crc32_part(name.encode(), crc))
        return struct.pack("<I", crc), MAV_PARAM_TYPE_UINT32

    def _bytes(self, name: str) -> bytes:
        return struct.pack("<i" if self.is_int(name) else "<f", self._stored[name])

    def _apply(self, name: str) -> None:
        parameter = self._table[name]
        value = min(max(float(self._stored[name]), parameter.low), parameter.high)
        self._applied[name] = value * self._speed if name in LOSS_TIMEOUTS else value
        self._on_change(name, self._applied[name])


def _as_stored(default: float | int) -> float | int:
    """Floats as they come back over MAVLink: in single precision."""
    return default if isinstance(default, int) else struct.unpack("<f", struct.pack("<f", default))[0]


def _crc32_part(data: bytes, crc: int) -> int:
    """CRC-32 without zlib's inversions before and after."""
    return zlib.crc32(data, crc ^ 0xFFFFFFFF) ^ 0xFFFFFFFF
