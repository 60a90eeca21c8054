"""The parameters of a fleet in a folder, one file per vehicle, in the format of QGroundControl.

As PX4 does, only what has been set is written: a default that changes with the next version takes effect.
"""

import contextlib
import math
import os
import struct
from pathlib import Path

from sitl.autopilot.memory import Memory
from sitl.autopilot.parameter_table import Parameter
from sitl.autopilot.parameters import MAV_PARAM_TYPE_INT32, MAV_PARAM_TYPE_REAL32
from sitl.errors import BadParameterFile

HEADER = "# Vehicle\tComponent\tName\tValue\tType"


class ParameterFiles:
    """Reads parameters before a simulation, and writes them whenever one has changed.

    Args:
        folder: where the files are; made if it is not there.
        table: what parameters there are.
    """

    def __init__(self, folder: Path, table: tuple[Parameter, ...]) -> None:
        self._folder = folder
        self._types = {parameter.name: _type_of(parameter) for parameter in table}
        self._written: dict[int, dict[str, float | int]] = {}
        folder.mkdir(parents=True, exist_ok=True)

    def path(self, sysid: int) -> Path:
        return self._folder / f"vehicle-{sysid}.params"

    def load(self, sysid: int) -> dict[str, float | int]:
        """The stored values of a vehicle; parameters that this autopilot does not have are passed over.

        Raises:
            BadParameterFile: naming file and line.
            OSError: the file cannot be read.
        """
        values: dict[str, float | int] = {}
        with contextlib.suppress(FileNotFoundError):
            text = self.path(sysid).read_text(encoding="utf-8", errors="replace")
            for number, line in enumerate(text.splitlines(), start=1):
                if line.strip() and not line.startswith("#"):
                    name, value = self._read(sysid, number, line)
                    if name in self._types:
                        values[name] = value
        self._written[sysid] = dict(values)
        return values

    def save(self, memories: dict[int, Memory]) -> None:
        """Write the files of the vehicles whose parameters have changed; a file is whole at every moment."""
        for sysid, memory in memories.items():
            if memory.parameters != self._written.get(sysid, {}):
                self._write(sysid, memory.parameters)
                self._written[sysid] = dict(memory.parameters)

    def _read(self, sysid: int, number: int, line: str) -> tuple[str, float | int]:
        try:
            _, _, name, text, kind = line.split("\t")
            if self._types.get(name, int(kind)) != int(kind):
                raise BadParameterFile(self.path(sysid), number, f"type {self._types[name]} of {name}", kind)
            value = _int32(text) if int(kind) == MAV_PARAM_TYPE_INT32 else _real32(text)
        except ValueError:
            raise BadParameterFile(self.path(sysid), number, "vehicle, component, name, value, type", line) from None
        return name, value

    def _write(self, sysid: int, values: dict[str, float | int]) -> None:
        lines = [f"{sysid}\t1\t{name}\t{_text(value)}\t{self._types[name]}" for name, value in sorted(values.items())]
        path = self.path(sysid)
        draft = path.with_suffix(".draft")
        draft.write_text("\n".join([HEADER, *lines, ""]), encoding="utf-8")
        os.replace(draft, path)


def _type_of(parameter: Parameter) -> int:
    return MAV_PARAM_TYPE_INT32 if isinstance(parameter.default, int) else MAV_PARAM_TYPE_REAL32


def _text(value: float | int) -> str:
    """Nine digits bring every float of single precision back."""
    return str(value) if isinstance(value, int) else f"{value:.9g}"


def _int32(text: str) -> int:
    value = int(text)
    if not -(2**31) <= value < 2**31:
        raise ValueError(text)
    return value


def _real32(text: str) -> float:
    value = float(text)
    if not math.isfinite(value) or abs(value) > 3.4028234e38:
        raise ValueError(text)
    return struct.unpack("<f", struct.pack("<f", value))[0]
