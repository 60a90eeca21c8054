"""Files of parameters, and what differs between one and a vehicle.

QGroundControl's lines are system id, component id, name, value and MAV_PARAM_TYPE, separated by tabs; those of MAVProxy
and Mission Planner are name and value. `#` begins a comment.
"""

import math
import re
import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from gcs.dialect import AUTOPILOT, mavlink
from gcs.errors import ParameterError
from gcs.microservices.parameter_client import Value
from gcs.microservices.parameter_fetch import Parameter

RELATIVE_TOLERANCE = 1e-6
_LAYOUTS = dict(enumerate("BbHhIiQqfd", start=mavlink.MAV_PARAM_TYPE_UINT8))
"""MAV_PARAM_TYPE -> how `struct` calls it."""
_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?", re.ASCII)
_LARGEST_INTEGER = mavlink.MAV_PARAM_TYPE_INT64
_NAME = re.compile(r"[A-Za-z0-9_]{1,16}", re.ASCII)


@dataclass(frozen=True)
class ParameterDifference:
    """One parameter that is not as in a file; None where one side has none of that name."""

    name: str
    in_file: Value | None
    on_vehicle: Value | None

    def __str__(self) -> str:
        return f"{self.name}: {shown_value(self.in_file)} in the file, {shown_value(self.on_vehicle)} on the vehicle"


def read_parameters(text: str, name: str = "parameters") -> dict[str, Parameter]:
    """The autopilot's parameters of a file; other components' are left out.

    Raises:
        ParameterError: a line that is none; names file, line, what was expected and found.
    """
    found: dict[str, Parameter] = {}
    for number, line in enumerate(text.splitlines(), 1):
        if line.strip() and not line.startswith("#"):
            key, component, parameter = _read_line(line, f"{name}:{number}")
            if key in found and component == AUTOPILOT:
                raise ParameterError(f"{name}:{number}: {key} a second time")
            if component == AUTOPILOT:
                found[key] = parameter
    return found


def write_parameters(parameters: Mapping[str, Parameter], sysid: int) -> str:
    """The text of a file."""
    rows = (f"{sysid}\t{AUTOPILOT}\t{name}\t{p.value!r}\t{p.kind}\n" for name, p in sorted(parameters.items()))
    return "# Vehicle-Id Component-Id Name Value Type\n" + "".join(rows)


def parameter_differences(
    in_file: Mapping[str, Parameter], on_vehicle: Mapping[str, Parameter]
) -> Iterator[ParameterDifference]:
    """Yield what the file has and the vehicle has not, or has otherwise; what the file does not name is left alone."""
    for name, wanted in sorted(in_file.items()):
        found = on_vehicle.get(name)
        if found is None:
            yield ParameterDifference(name, wanted.value, None)
        elif not math.isclose(wanted.value, found.value, rel_tol=RELATIVE_TOLERANCE, abs_tol=1e-9):
            yield ParameterDifference(name, wanted.value, found.value)


def _read_line(line: str, where: str) -> tuple[str, int, Parameter]:
    fields = line.replace(",", " ").split()
    try:
        if len(fields) == 2:
            name, value = fields
            component, kind = AUTOPILOT, mavlink.MAV_PARAM_TYPE_REAL32
            if "." not in value:
                kind = mavlink.MAV_PARAM_TYPE_INT32
        else:
            _, component, name, value, kind = fields
        if not _NAME.fullmatch(name):
            raise ValueError
        return name, int(component), Parameter(_value(value, int(kind)), int(kind))
    except (ValueError, KeyError, struct.error, OverflowError):
        shown = line if len(line) <= 80 else f"{line[:80]}..."
        expected = "system, component, name, value, type, or name and value"
        raise ParameterError(f"{where}: expected {expected}; found {shown!r}") from None


def _value(text: str, kind: int) -> Value:
    """A number that fits into its type; raises one of several errors otherwise."""
    if not _NUMBER.fullmatch(text):
        raise ValueError
    layout = _LAYOUTS[kind]
    value: Value = float(text) if layout in "fd" else int(text)
    struct.pack(f"<{layout}", value)
    return value


def read_value(text: str) -> Value:
    """A number as an operator gives it.

    Raises:
        ParameterError: it is none; NaN and infinity are not, since autopilots store them and fail of them.
    """
    try:
        return _value(text, mavlink.MAV_PARAM_TYPE_REAL32 if "." in text or "e" in text.lower() else _LARGEST_INTEGER)
    except (ValueError, struct.error, OverflowError):
        raise ParameterError(f"expected a number, found {text[:40]!r}") from None


def shown_value(value: Value | None) -> str:
    """As an operator reads it."""
    return "none" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
