"""Faults that an experimenter orders: what goes wrong, with whom and when.

On the command line a fault is `KIND:key=value,key=value`, for example `companion-hang:vehicle=1,at_s=4`; in a mission
file it is a mapping with a `type`; on the simulator's control port it is the same mapping as one line of JSON.
"""

from enum import Enum
from typing import Annotated, Any

import msgspec

from missions.errors import MissionError

SystemId = Annotated[int, msgspec.Meta(ge=1, le=250)]
NotNegative = Annotated[float, msgspec.Meta(ge=0.0, le=1e9)]
Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
WindComponent = Annotated[float, msgspec.Meta(ge=-50.0, le=50.0)]


class CompanionKill(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="companion-kill"):
    """A companion process ends at once, as by SIGKILL."""

    vehicle: SystemId
    at_s: NotNegative
    """Vehicle time since the companion took control [s]."""


class CompanionHang(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="companion-hang"):
    """A companion process hangs for good inside a call that holds Python's interpreter lock."""

    vehicle: SystemId
    at_s: NotNegative
    """Vehicle time since the companion took control [s]."""


Fault = CompanionKill | CompanionHang

EXAMPLES = ("companion-kill:vehicle=1,at_s=4", "companion-hang:vehicle=2,at_s=2.5")


# --------------------------------------------------------------- the simulator's
class LinkConditions(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a link does to datagrams, both ways."""

    loss: Share = 0.0
    delay_s: NotNegative = 0.0
    jitter_s: NotNegative = 0.0
    """Each datagram takes up to this much longer."""
    duplicates: Share = 0.0
    """How many of them arrive twice."""
    reorder: Share = 0.0
    """How many of them are overtaken by those behind."""
    corruption: Share = 0.0
    """How many of them arrive with one byte changed."""
    bandwidth_bytes_s: NotNegative = 0.0
    """Each way; 0 is no limit. What would have to wait for more than a second is lost."""


class SimulatedLink(Enum):
    """One of a vehicle's two links, or its radio to the other companions."""

    GROUND = "ground"
    ONBOARD = "onboard"
    FLEET = "fleet"


class LinkFault(LinkConditions, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="link"):
    """A link becomes as described; what is not named is perfect. Nothing but type and link makes it whole again."""

    link: SimulatedLink = SimulatedLink.GROUND
    vehicle: SystemId | None = None
    """System id; none means all vehicles."""
    blackout_s: NotNegative = 0.0
    """Nothing passes for this long, from now on."""
    at_s: NotNegative | None = None
    """Simulated time since the first take-off [s]; none means at once."""


class GpsLoss(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="gps-loss"):
    """Nothing tells an autopilot where it is: no GPS, and no vision indoors."""

    vehicle: SystemId | None = None
    duration_s: NotNegative | None = None
    """None means for good; 0 ends a loss."""
    at_s: NotNegative | None = None


class MotorFailure(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="motor-failure"):
    """A motor follows only a share of its signal."""

    vehicle: SystemId
    motor: Annotated[int, msgspec.Meta(ge=1, le=4)]
    """1 front right, 2 back left, 3 front left, 4 back right."""
    health: Share = 0.0
    """1 makes it whole again."""
    at_s: NotNegative | None = None


class BatteryLevel(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="battery"):
    """A battery has this much charge left; never more again until the next such order."""

    vehicle: SystemId | None = None
    remaining: Share
    at_s: NotNegative | None = None


class SensorNoise(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="sensor-noise"):
    """Estimates wander this far."""

    vehicle: SystemId | None = None
    horizontal_std_m: NotNegative
    vertical_std_m: NotNegative
    velocity_std_m_s: NotNegative
    at_s: NotNegative | None = None


class Weather(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="weather"):
    """The wind, for all vehicles."""

    east_m_s: WindComponent = 0.0
    north_m_s: WindComponent = 0.0
    up_m_s: WindComponent = 0.0
    gust_std_m_s: NotNegative = 0.0
    at_s: NotNegative | None = None


class Reboot(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="reboot"):
    """An autopilot boots anew, wherever its vehicle is; its motors stop."""

    vehicle: SystemId
    at_s: NotNegative | None = None


class ClockJump(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, tag="clock-jump"):
    """What an autopilot takes for UTC jumps, as when GPS has its time at last; its time since boot does not."""

    vehicle: SystemId
    by_s: Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]
    at_s: NotNegative | None = None


SimulatorFault = LinkFault | GpsLoss | MotorFailure | BatteryLevel | SensorNoise | Weather | Reboot | ClockJump

SIMULATOR_EXAMPLES = (
    "link:vehicle=1,link=ground,loss=0.3,delay_s=0.1",
    "gps-loss:vehicle=2,at_s=5,duration_s=10",
    "motor-failure:vehicle=1,motor=3,at_s=4",
)


def parse_fault(text: str) -> Fault:
    """Read a companion's fault as it is written on the command line.

    Raises:
        MissionError: naming what was expected and what was found.

    Example:
        >>> parse_fault("companion-kill:vehicle=1,at_s=4")
        CompanionKill(vehicle=1, at_s=4.0)
    """
    return _parsed(text, Fault, EXAMPLES)


def parse_simulator_fault(text: str) -> SimulatorFault:
    """Read a fault of the simulator as it is written on the command line.

    Raises:
        MissionError: naming what was expected and what was found.

    Example:
        >>> parse_simulator_fault("battery:vehicle=1,remaining=0.06")
        BatteryLevel(vehicle=1, remaining=0.06, at_s=None)
    """
    return _parsed(text, SimulatorFault, SIMULATOR_EXAMPLES)


def decode_simulator_fault(line: bytes) -> SimulatorFault:
    """Read a fault of the simulator as it comes over the control port.

    Raises:
        MissionError: naming what was expected and what was found.

    Example:
        >>> decode_simulator_fault(b'{"type": "reboot", "vehicle": 2}')
        Reboot(vehicle=2, at_s=None)
    """
    try:
        return msgspec.json.decode(line, type=SimulatorFault)
    except (msgspec.DecodeError, UnicodeDecodeError) as invalid:
        raise MissionError(f"control: {invalid}") from None
    except RecursionError:
        raise MissionError("control: expected one fault, found values nested too deeply") from None


def parse_any_fault(text: str) -> Fault | SimulatorFault:
    """Read a fault of a companion or of the simulator as it is written on the command line.

    Raises:
        MissionError: naming what was expected and what was found.

    Example:
        >>> parse_any_fault("reboot:vehicle=1"), parse_any_fault("companion-kill:vehicle=1,at_s=4")
        (Reboot(vehicle=1, at_s=None), CompanionKill(vehicle=1, at_s=4.0))
    """
    return _parsed(text, Fault | SimulatorFault, (EXAMPLES[0], SIMULATOR_EXAMPLES[0]))


def format_fault(fault: Fault | SimulatorFault) -> str:
    """The text that `parse_any_fault` reads back.

    Example:
        >>> format_fault(LinkFault(vehicle=1, loss=0.25))
        'link:loss=0.25,link=ground,vehicle=1'
    """
    fields = msgspec.to_builtins(fault)
    defaults = {field.name: field.default for field in msgspec.structs.fields(fault)}
    kind = fields.pop("type")
    said = {key: value for key, value in fields.items() if value != defaults[key]}
    texts = (f"{key}={value if isinstance(value, str) else f'{value:.12g}'}" for key, value in said.items())
    return f"{kind}:" + ",".join(texts)


def _parsed(text: str, kinds: Any, examples: tuple[str, ...]) -> Any:
    kind, _, rest = text.partition(":")
    fields = {key: value for key, _, value in (part.partition("=") for part in rest.split(",") if part)}
    try:
        return msgspec.convert({"type": kind, **fields}, kinds, strict=False)
    except msgspec.ValidationError as invalid:
        raise MissionError(f"--fault {text}: {invalid}; expected something like {' or '.join(examples)}") from None
