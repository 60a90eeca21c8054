"""Faults that an experimenter orders: what goes wrong, with whom and when.

On the command line a fault is `KIND:key=value,key=value`, for example `companion-hang:vehicle=1,at_s=4`.
"""

from typing import Annotated

import msgspec

from missions.errors import MissionError


class CompanionKill(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="companion-kill"):
    """A companion process ends at once, as by SIGKILL."""

    vehicle: Annotated[int, msgspec.Meta(ge=1, le=250)]
    """System id."""
    at_s: Annotated[float, msgspec.Meta(ge=0.0)]
    """Vehicle time since the companion took control [s]."""


class CompanionHang(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="companion-hang"):
    """A companion process hangs for good inside a call that holds Python's interpreter lock."""

    vehicle: Annotated[int, msgspec.Meta(ge=1, le=250)]
    """System id."""
    at_s: Annotated[float, msgspec.Meta(ge=0.0)]
    """Vehicle time since the companion took control [s]."""


Fault = CompanionKill | CompanionHang

EXAMPLES = ("companion-kill:vehicle=1,at_s=4", "companion-hang:vehicle=2,at_s=2.5")


def parse_fault(text: str) -> Fault:
    """Read a fault as it is written on the command line.

    Raises:
        MissionError: naming what was expected and what was found.

    Example:
        >>> parse_fault("companion-kill:vehicle=1,at_s=4")
        CompanionKill(vehicle=1, at_s=4.0)
    """
    kind, _, rest = text.partition(":")
    fields = {key: value for key, _, value in (part.partition("=") for part in rest.split(",") if part)}
    try:
        return msgspec.convert({"type": kind, **fields}, Fault, strict=False)
    except msgspec.ValidationError as invalid:
        examples = " or ".join(EXAMPLES)
        raise MissionError(f"--fault {text}: {invalid}; expected something like {examples}") from None


def format_fault(fault: Fault) -> str:
    """The text that `parse_fault` reads back."""
    fields = msgspec.to_builtins(fault)
    kind = fields.pop("type")
    return f"{kind}:" + ",".join(f"{key}={value:g}" for key, value in fields.items())
