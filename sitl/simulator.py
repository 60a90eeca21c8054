"""The whole fleet on a virtual clock: physics, autopilots, MAVLink, ground-link faults. No socket, no wall clock.

One seed is one flight, to the bit: everything random comes from generators that the seed makes, and time advances by
fixed steps.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from missions.mission import Mission
from sitl.dynamics.airframe import X500_LIKE, Airframe
from sitl.dynamics.state import Crash
from sitl.fleet import TICK_S, Fleet
from sitl.link.ground_link import Direction, GroundLink
from sitl.microservices.outbox import Link
from sitl.open_field import open_field
from sitl.vehicle import Vehicle

Array = npt.NDArray[np.float64]

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
    ) -> None:
        mission = open_field(mission) if isinstance(mission, int) else mission
        self.mission = mission
        physics_rng, *link_rngs = (
            np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(1 + len(mission.vehicles))
        )
        self._fleet = Fleet(mission, airframe, physics_rng)
        self._ticks = 0
        self._first_takeoff_s: float | None = None
        self._out: list[tuple[int, Link, bytes]] = []
        self.collisions: list[Collision] = []
        self._known_crashes = {vehicle.sysid: float(Crash.NONE) for vehicle in mission.vehicles}
        views = self._fleet.views()
        self.vehicles = {
            vehicle.sysid: Vehicle(
                sysid=vehicle.sysid,
                body=self._fleet.vehicles[index],
                gains=self._fleet.gains[index],
                airframe=airframe,
                positioning=mission.simulation.positioning,
                speed=speed,
                utc_start_us=utc_start_us,
                first_view=views[index],
            )
            for index, vehicle in enumerate(mission.vehicles)
        }
        self._ground = {
            vehicle.sysid: GroundLink(mission.simulation.ground_link, rng)
            for vehicle, rng in zip(mission.vehicles, link_rngs, strict=True)
        }

    @property
    def time_s(self) -> float:
        """Simulated time since boot."""
        return self._ticks * TICK_S

    @property
    def truth(self) -> Truth:
        """Where the vehicles really are now."""
        return Truth(
            time_s=self.time_s,
            sysids=tuple(self.vehicles),
            position_enu_m=self._fleet.positions_enu_m,
            velocity_enu_m_s=self._fleet.velocities_enu_m_s,
            attitude_ned_frd=self._fleet.vehicles["attitude"].copy(),
            crashed=self._fleet.vehicles["crash"] != Crash.NONE,
        )

    def receive(self, sysid: int, link: Link, datagram: bytes) -> None:
        """A datagram for a vehicle has come in on one of its links."""
        ground = self._ground[sysid]
        if link is Link.ONBOARD or ground.is_perfect:
            self._deliver(sysid, link, datagram)
        else:
            ground.send(Direction.UP, datagram, self.time_s, self._since_takeoff_s)

    def step(self) -> None:
        """Advance everything by one tick."""
        start_s = self.time_s
        snapshots = self._fleet.advance(start_s)
        self._ticks += 1
        now_s = self.time_s
        for (sysid, vehicle), snapshot in zip(self.vehicles.items(), snapshots, strict=True):
            for datagram in self._ground[sysid].arrived(Direction.UP, now_s):
                vehicle.receive(Link.GROUND, datagram)
            vehicle.tick(snapshot, now_s, TICK_S)
            if self._first_takeoff_s is None and not snapshot.grounded:
                self._first_takeoff_s = now_s
            if snapshot.crash != self._known_crashes[sysid]:
                self._known_crashes[sysid] = snapshot.crash
                self._note_collision(sysid)
            self._collect(sysid, vehicle)

    def transmissions(self) -> list[tuple[int, Link, bytes]]:
        """What the vehicles have sent since the last call: (system id, link, one frame), in order."""
        out, self._out = self._out, []
        return out

    @property
    def _since_takeoff_s(self) -> float | None:
        return None if self._first_takeoff_s is None else self.time_s - self._first_takeoff_s

    def _deliver(self, sysid: int, link: Link, datagram: bytes) -> None:
        vehicle = self.vehicles[sysid]
        vehicle.receive(link, datagram)
        self._collect(sysid, vehicle)

    def _collect(self, sysid: int, vehicle: Vehicle) -> None:
        """Move what a vehicle has sent to the outside, through the faults of its ground link."""
        ground = self._ground[sysid]
        frames = vehicle.outbox.take()
        if ground.is_perfect:
            self._out.extend((sysid, link, frame) for link, frame in frames)
            return
        for link, frame in frames:
            if link is Link.ONBOARD:
                self._out.append((sysid, link, frame))
            else:
                ground.send(Direction.DOWN, frame, self.time_s, self._since_takeoff_s)
        arrived = ground.arrived(Direction.DOWN, self.time_s)
        self._out.extend((sysid, Link.GROUND, frame) for frame in arrived)

    def _note_collision(self, sysid: int) -> None:
        index = tuple(self.vehicles).index(sysid)
        body = self._fleet.vehicles[index]
        east, north, up = self._fleet.positions_enu_m[index].tolist()
        what = Crash(int(body["crash"]))
        other = self._name_of(what, int(body["crash_other"]))
        self.collisions.append(Collision(self.time_s, sysid, what, (east, north, up), other))

    def _name_of(self, what: Crash, index: int) -> str:
        if what is Crash.MOVER:
            return self.mission.world.movers[index].name
        return str(self.mission.vehicles[index].sysid) if what is Crash.VEHICLE else ""
