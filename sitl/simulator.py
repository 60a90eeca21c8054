"""The whole fleet on a virtual clock: physics, autopilots, MAVLink, faults. No socket, no wall clock.

One seed is one flight, to the bit: everything random comes from generators that the seed makes, and time advances by
fixed steps.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from missions.faults import SimulatorFault
from missions.mission import Mission
from sitl.autopilot.memory import Memory
from sitl.dynamics.airframe import X500_LIKE, Airframe
from sitl.dynamics.state import Crash
from sitl.fault_injection import Breakable, FaultInjector
from sitl.fleet import TICK_S, Fleet
from sitl.link.faulty_link import Direction, FaultyLink
from sitl.link.radio import FleetRadio
from sitl.microservices.outbox import Link
from sitl.microservices.telemetry import Surroundings
from sitl.open_field import open_field
from sitl.sensors.lidar import PacketStream, RangeSensors
from sitl.snapshot import Snapshot
from sitl.vehicle import Vehicle

Array = npt.NDArray[np.float64]

REBOOT_S = 1.0
"""An autopilot that boots anew is silent and deaf for this long."""
UTC_START_US = 1_767_225_600_000_000
"""2026-01-01 00:00 UTC: when simulations begin that are not told otherwise."""


@dataclass(frozen=True)
class Truth:
    """Where the vehicles really are, in the mission's frame."""

    time_s: float
    sysids: tuple[int, ...]
    position_enu_m: Array
    """(n, 3)"""
    velocity_enu_m_s: Array
    """(n, 3)"""
    attitude_ned_frd: Array
    """(n, 4) quaternions w, x, y, z: body FRD -> NED."""
    crashed: npt.NDArray[np.bool_]
    """(n,)"""


@dataclass(frozen=True)
class Collision:
    """A vehicle has hit something."""

    time_s: float
    sysid: int
    what: Crash
    position_enu_m: tuple[float, float, float]
    other: str = ""
    """Name of the mover or system id of the vehicle that was hit."""

    def __str__(self) -> str:
        place = ", ".join(f"{coordinate:.2f}" for coordinate in self.position_enu_m)
        other = f" {self.other}" if self.other else ""
        return f"vehicle {self.sysid} hit {self.what.name.lower()}{other} at ({place}) m, {self.time_s:.2f} s"


class Simulator:
    """All vehicles of a mission, advanced tick by tick of 20 ms.

    Args:
        mission: the vehicles and the world that they are in, or how many vehicles to put on open ground.
        seed: of everything random.
        speed: simulated seconds per wall-clock second, as far as the vehicles' timeouts must know.
        airframe: the body of every vehicle.
        utc_start_us: UTC at boot.
        memories: system id -> what a vehicle has kept from earlier runs.
        lidar: whether the vehicles carry the mission's range sensor; it costs more than everything else.

    Raises:
        MissionError: one of the mission's faults names a vehicle that is not there.

    Example:
        >>> from missions.mission import load_mission
        >>> simulator = Simulator(load_mission("indoor"), seed=1)
        >>> simulator.step()
        >>> simulator.time_s, sorted({sysid for sysid, link, frame in simulator.transmissions()})
        (0.02, [1, 2])
    """

    def __init__(
        self,
        mission: Mission | int,
        *,
        seed: int,
        speed: float = 1.0,
        airframe: Airframe = X500_LIKE,
        utc_start_us: int = UTC_START_US,
        memories: Mapping[int, Memory] | None = None,
        lidar: bool = False,
    ) -> None:
        mission = open_field(mission) if isinstance(mission, int) else mission
        self.mission = mission
        self._speed, self._airframe, self._utc_start_us = speed, airframe, utc_start_us
        n = len(mission.vehicles)
        physics_rng, *link_rngs = (
            np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(1 + 2 * n)
        )
        self._fleet = Fleet(mission, airframe, physics_rng)
        self._range_sensors = RangeSensors(mission, np.random.default_rng([seed, *b"lidar"])) if lidar else None
        self._lidar_out: list[tuple[int, bytes]] = []
        self._ticks = 0
        self.first_takeoff_s: float | None = None
        """Faults and blackouts are counted from here on [s], as `time_s` is."""
        self._out: list[tuple[int, Link, bytes]] = []
        self.collisions: list[Collision] = []
        self._index = {vehicle.sysid: index for index, vehicle in enumerate(mission.vehicles)}
        self._lidar_streams = {sysid: PacketStream() for sysid in self._index}
        self._known_crashes = dict.fromkeys(self._index, float(Crash.NONE))
        self._memories = {sysid: (memories or {}).get(sysid) or Memory() for sysid in self._index}
        self._booted_s = dict.fromkeys(self._index, 0.0)
        self._asleep_until_s: dict[int, float] = {}
        """Vehicles whose autopilot is booting anew."""
        views = self._fleet.views()
        self.vehicles = {sysid: self._boot(sysid, views[index]) for sysid, index in self._index.items()}
        settings = mission.simulation.ground_link, mission.simulation.onboard_link
        self._links = {
            sysid: {
                Link.GROUND: FaultyLink(settings[0], link_rngs[index]),
                Link.ONBOARD: FaultyLink(settings[1], link_rngs[n + index]),
            }
            for sysid, index in self._index.items()
        }
        self._radio = FleetRadio(mission.simulation.fleet_link, self._index, seed)
        breakable = {sysid: self._breakable(sysid) for sysid in self._index}
        self._faults = FaultInjector(self._fleet, breakable, self._radio)
        for fault in mission.simulation.faults:
            self.order(fault)

    @property
    def memories(self) -> dict[int, Memory]:
        """System id -> what the vehicle keeps for its next boot."""
        return self._memories

    @property
    def time_s(self) -> float:
        """Simulated time since boot."""
        return self._ticks * TICK_S

    @property
    def motion(self) -> tuple[Array, Array]:
        """(n, 3) positions [m] and (n, 3) velocities [m/s] of the vehicles, ENU, as they really are now."""
        return self._fleet.positions_enu_m, self._fleet.velocities_enu_m_s

    @property
    def truth(self) -> Truth:
        """Where the vehicles really are now."""
        position_enu_m, velocity_enu_m_s = self.motion
        return Truth(
            time_s=self.time_s,
            sysids=tuple(self.vehicles),
            position_enu_m=position_enu_m,
            velocity_enu_m_s=velocity_enu_m_s,
            attitude_ned_frd=self._fleet.vehicles["attitude"].copy(),
            crashed=self._fleet.vehicles["crash"] != Crash.NONE,
        )

    def order(self, fault: SimulatorFault) -> None:
        """Let something go wrong, now or when the fault says.

        Raises:
            MissionError: there is no such vehicle.
        """
        self._faults.order(fault, self.time_s)

    def receive(self, sysid: int, link: Link, datagram: bytes) -> None:
        """A datagram for a vehicle has come in on one of its links."""
        way_in = self._links[sysid][link]
        if way_in.is_perfect(self.time_s):
            self._deliver(sysid, link, datagram)
            self._collect(sysid)
        else:
            way_in.send(Direction.UP, datagram, self.time_s, self._since_takeoff_s)

    def step(self) -> None:
        """Advance everything by one tick."""
        snapshots = self._fleet.advance(self.time_s)
        self._ticks += 1
        now_s = self.time_s
        self._faults.tick(now_s, self._since_takeoff_s)
        self._look_around()
        for sysid, snapshot in zip(self.vehicles, snapshots, strict=True):
            for link, way_in in self._links[sysid].items():
                if not way_in.is_perfect(now_s):
                    for datagram in way_in.arrived(Direction.UP, now_s):
                        self._deliver(sysid, link, datagram)
            if self.first_takeoff_s is None and not snapshot.grounded:
                self.first_takeoff_s = now_s
            if snapshot.crash != self._known_crashes[sysid]:
                self._known_crashes[sysid] = snapshot.crash
                self._note_collision(sysid)
            self._tick(sysid, snapshot)
            self._collect(sysid)

    def transmissions(self) -> list[tuple[int, Link, bytes]]:
        """What the vehicles have sent since the last call: (system id, link, one frame), in order."""
        out, self._out = self._out, []
        return out

    def lidar_datagrams(self) -> list[tuple[int, bytes]]:
        """What the lidars have sent since the last call: (system id, one datagram), in order."""
        out, self._lidar_out = self._lidar_out, []
        return out

    def receive_radio(self, sysid: int, datagram: bytes) -> None:
        """A vehicle's companion speaks to all others."""
        self._radio.send(sysid, datagram, self.time_s, self._since_takeoff_s)

    def radio_datagrams(self) -> list[tuple[int, bytes]]:
        """What companions hear since the last call: (system id of who hears it, one datagram), in order."""
        return self._radio.arrived(self.time_s)

    def _look_around(self) -> None:
        """Let the range sensors scan, if there are any and it is time."""
        sensors, now_s = self._range_sensors, self.time_s
        if sensors is None or not sensors.is_due(now_s):
            return
        truth = self.truth
        clocks_s = np.array([now_s - booted_s for booted_s in self._booted_s.values()])
        scans = sensors.scan(now_s, truth.position_enu_m, truth.attitude_ned_frd, clocks_s)
        for sysid, scan in zip(self._index, scans, strict=True):
            self.vehicles[sysid].surroundings = Surroundings(scan.time_s, scan.distances_m, self.mission.sensor.range_m)
            self._lidar_out.extend((sysid, datagram) for datagram in self._lidar_streams[sysid].datagrams(scan))

    @property
    def _since_takeoff_s(self) -> float | None:
        return None if self.first_takeoff_s is None else self.time_s - self.first_takeoff_s

    def _tick(self, sysid: int, snapshot: Snapshot) -> None:
        """Let one autopilot have its turn, if it is not booting."""
        if sysid in self._asleep_until_s:
            self._wake(sysid)
        else:
            self.vehicles[sysid].tick(snapshot, self.time_s - self._booted_s[sysid], TICK_S)

    def _deliver(self, sysid: int, link: Link, datagram: bytes) -> None:
        if sysid not in self._asleep_until_s:
            self.vehicles[sysid].receive(link, datagram)

    def _collect(self, sysid: int) -> None:
        """Move what a vehicle has sent to the outside, through the faults of its links."""
        now_s, links, vehicle = self.time_s, self._links[sysid], self.vehicles[sysid]
        faulty = [link for link, way_out in links.items() if not way_out.is_perfect(now_s)]
        for link, frame in vehicle.take():
            if link in faulty:
                links[link].send(Direction.DOWN, frame, now_s, self._since_takeoff_s)
            else:
                self._out.append((sysid, link, frame))
        for link in faulty:
            self._out.extend((sysid, link, frame) for frame in links[link].arrived(Direction.DOWN, now_s))
        if vehicle.autopilot.reboot_ordered and sysid not in self._asleep_until_s:
            self._reboot(sysid)

    # ------------------------------------------------------------------- boot
    def _boot(self, sysid: int, view: Snapshot) -> Vehicle:
        index = self._index[sysid]
        return Vehicle(
            sysid=sysid,
            body=self._fleet.vehicles[index],
            gains=self._fleet.gains[index],
            airframe=self._airframe,
            positioning=self.mission.simulation.positioning,
            speed=self._speed,
            utc_start_us=self._utc_start_us + round(self.time_s * 1e6),
            wall_start_us=self._utc_start_us + round(self.time_s / self._speed * 1e6),
            first_view=view,
            memory=self._memories[sysid],
        )

    def _reboot(self, sysid: int) -> None:
        """Stop one autopilot, and its motors with it; it comes back after a while."""
        self._fleet.stop_motors(self._index[sysid])
        self._asleep_until_s[sysid] = self.time_s + REBOOT_S

    def _wake(self, sysid: int) -> None:
        if self.time_s < self._asleep_until_s[sysid]:
            return
        del self._asleep_until_s[sysid]
        index = self._index[sysid]
        self._fleet.restart_autopilot(index)
        self._booted_s[sysid] = self.time_s
        self.vehicles[sysid] = self._boot(sysid, self._fleet.views()[index])

    def _breakable(self, sysid: int) -> Breakable:
        return Breakable(
            index=self._index[sysid],
            links=self._links[sysid],
            charge=self._memories[sysid].charge,
            reboot=lambda: self._reboot(sysid),
            set_clock=lambda by_s: self.vehicles[sysid].set_clock(by_s),
        )

    # ------------------------------------------------------------- collisions
    def _note_collision(self, sysid: int) -> None:
        index = self._index[sysid]
        body = self._fleet.vehicles[index]
        east, north, up = self._fleet.positions_enu_m[index].tolist()
        what = Crash(int(body["crash"]))
        other = self._name_of(what, int(body["crash_other"]))
        self.collisions.append(Collision(self.time_s, sysid, what, (east, north, up), other))

    def _name_of(self, what: Crash, index: int) -> str:
        if what is Crash.MOVER:
            return self.mission.world.movers[index].name
        return str(self.mission.vehicles[index].sysid) if what is Crash.VEHICLE else ""
