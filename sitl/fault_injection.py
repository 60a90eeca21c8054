"""Applies the faults that an experimenter orders, at once or when their time has come."""

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

from missions.errors import MissionError
from missions.faults import (
    BatteryLevel,
    ClockJump,
    GpsLoss,
    LinkFault,
    MotorFailure,
    Reboot,
    SensorNoise,
    SimulatedLink,
    SimulatorFault,
    Weather,
)
from sitl.autopilot.memory import Charge
from sitl.fleet import Fleet
from sitl.link.faulty_link import FaultyLink
from sitl.link.radio import FleetRadio
from sitl.microservices.outbox import Link


@dataclass(frozen=True)
class Breakable:
    """What can be broken of one vehicle.

    Args:
        index: its place in the fleet.
        links: its two links.
        charge: its battery's.
        reboot: boots its autopilot anew.
        set_clock: moves its UTC by so many seconds.
    """

    index: int
    links: Mapping[Link, FaultyLink]
    charge: Charge
    reboot: Callable[[], None]
    set_clock: Callable[[float], None]


class FaultInjector:
    """The faults of a fleet.

    Args:
        fleet: the bodies, the estimators and the weather.
        vehicles: system id -> what else can be broken.
        radio: between the companions.
    """

    def __init__(self, fleet: Fleet, vehicles: Mapping[int, Breakable], radio: FleetRadio) -> None:
        self._fleet = fleet
        self._vehicles = vehicles
        self._radio = radio
        self._waiting: list[SimulatorFault] = []
        self._positioning_back_s: dict[int, float] = {}

    def order(self, fault: SimulatorFault, now_s: float) -> None:
        """Apply a fault now, or keep it until its time comes.

        Raises:
            MissionError: there is no such vehicle.
        """
        sysid = None if isinstance(fault, Weather) else fault.vehicle
        if sysid is not None and sysid not in self._vehicles:
            known = ", ".join(str(known) for known in self._vehicles)
            raise MissionError(f"fault: vehicle: expected one of {known}, found {sysid}")
        if fault.at_s is None:
            self._apply(fault, now_s)
        else:
            self._waiting.append(fault)

    def tick(self, now_s: float, since_takeoff_s: float | None) -> None:
        """Apply what is due, and end what is over."""
        for sysid, back_s in list(self._positioning_back_s.items()):
            if now_s >= back_s:
                self._set_positioning(sysid, lost=False, until_s=math.inf)
        if since_takeoff_s is None or not self._waiting:
            return
        due = [fault for fault in self._waiting if fault.at_s is not None and fault.at_s <= since_takeoff_s]
        self._waiting = [fault for fault in self._waiting if fault not in due]
        for fault in due:
            self._apply(fault, now_s)

    def _apply(self, fault: SimulatorFault, now_s: float) -> None:
        match fault:
            case LinkFault():
                self._break_links(fault, now_s)
            case GpsLoss():
                duration_s = math.inf if fault.duration_s is None else fault.duration_s
                for sysid in self._named(fault.vehicle):
                    self._set_positioning(sysid, lost=duration_s > 0.0, until_s=now_s + duration_s)
            case MotorFailure():
                self._fleet.fail_rotor(self._vehicles[fault.vehicle].index, fault.motor - 1, fault.health)
            case BatteryLevel():
                for sysid in self._named(fault.vehicle):
                    self._vehicles[sysid].charge.limit(fault.remaining)
            case SensorNoise():
                for sysid in self._named(fault.vehicle):
                    self._fleet.set_noise(
                        self._vehicles[sysid].index,
                        horizontal_std_m=fault.horizontal_std_m,
                        vertical_std_m=fault.vertical_std_m,
                        velocity_std_m_s=fault.velocity_std_m_s,
                    )
            case Weather():
                self._fleet.set_weather((fault.east_m_s, fault.north_m_s, fault.up_m_s), fault.gust_std_m_s)
            case Reboot():
                self._vehicles[fault.vehicle].reboot()
            case ClockJump():
                self._vehicles[fault.vehicle].set_clock(fault.by_s)

    def _break_links(self, fault: LinkFault, now_s: float) -> None:
        black_until_s = now_s + fault.blackout_s
        for sysid in self._named(fault.vehicle):
            if fault.link is SimulatedLink.FLEET:
                self._radio.change(sysid, fault, black_until_s)
            else:
                link = self._vehicles[sysid].links[Link(fault.link.value)]
                link.change(fault)
                link.black_out(black_until_s)

    def _set_positioning(self, sysid: int, *, lost: bool, until_s: float) -> None:
        self._fleet.lose_positioning(self._vehicles[sysid].index, lost=lost)
        self._positioning_back_s.pop(sysid, None)
        if lost and math.isfinite(until_s):
            self._positioning_back_s[sysid] = until_s

    def _named(self, sysid: int | None) -> Iterable[int]:
        return self._vehicles if sysid is None else (sysid,)
