"""The autopilot's safety settings that a flight relies on: checked always, set with the mission's consent."""

import math
from dataclasses import dataclass

from gcs.dialect import AUTOPILOT
from gcs.errors import PreflightError
from gcs.flight.fence import fence_height_m, return_height_m
from gcs.microservices.parameter_client import ParameterExchange, Value
from gcs.station import Station
from missions.mission import Mission

HOLD_ON_OFFBOARD_LOSS = 5
"""COM_OBL_RC_ACT: PX4's default, 0, sinks and lands where no sticks are."""

OFFBOARD_LOSS_TIMEOUT_S = 1.0

OVERSHOOT_SHARE = 0.07
"""Autopilots fly up to 6 % faster than ordered before they settle: so much less is ordered of their own flight."""


@dataclass(frozen=True)
class Requirement:
    """One parameter, the value to set, and whether a smaller one would do as well."""

    name: str
    value: Value
    why: str
    less_is_fine: bool = False

    def met_by(self, found: Value) -> bool:
        """The wire carries parameters in single precision."""
        return (self.less_is_fine and found < self.value) or math.isclose(found, self.value, rel_tol=1e-6)


def requirements(mission: Mission, speed: float) -> tuple[Requirement, ...]:
    """What a flight of `mission` needs; with a speed factor the autopilot's loss times are wall-clock times, too."""
    timeout_s = OFFBOARD_LOSS_TIMEOUT_S * speed
    own_speed_m_s = (1.0 - OVERSHOOT_SHARE) * mission.limits.cruise_speed_m_s
    return (
        Requirement("COM_OBL_RC_ACT", HOLD_ON_OFFBOARD_LOSS, "hold when the companion's setpoints stop"),
        Requirement("COM_OF_LOSS_T", timeout_s, "notice soon that setpoints stop", less_is_fine=True),
        Requirement("NAV_DLL_ACT", 0, "fly on without a link to the ground"),
        Requirement("GF_MAX_VER_DIST", fence_height_m(mission), "the fence's height"),
        Requirement("MPC_XY_VEL_MAX", mission.limits.cruise_speed_m_s, "never faster than the mission"),
        Requirement("MPC_XY_CRUISE", own_speed_m_s, "returns and go-tos overshoot their speed", less_is_fine=True),
        Requirement("RTL_RETURN_ALT", return_height_m(mission), "return below the ceiling", less_is_fine=True),
    )


async def ensure(station: Station, sysid: int, mission: Mission, speed: float) -> list[str]:
    """Check all requirements on a vehicle and, with the mission's consent, set what differs.

    Returns:
        what was changed, one sentence per parameter.

    Raises:
        PreflightError: something differs and the mission does not consent to setting it.
        ParameterError: a parameter could not be read or set.
    """
    peer = (sysid, AUTOPILOT)
    changes: list[str] = []
    for required in requirements(mission, speed):
        found = (await station.run(ParameterExchange(peer, required.name))).value
        assert found is not None  # the exchange ends with a value or raises
        if required.met_by(found):
            continue
        if not mission.set_parameters:
            raise PreflightError(
                f"vehicle {sysid}: {required.name} is {found:g}, expected {required.value:g} ({required.why}); "
                "set it, or let the mission say `set_parameters: true`"
            )
        await station.run(ParameterExchange(peer, required.name, new_value=required.value))
        changes.append(f"{required.name} {found:g} -> {required.value:g}: {required.why}")
    return changes
