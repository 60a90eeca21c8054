"""A simulated vehicle and a hand on its links, for tests that read like flights."""

import functools
import math
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np

from missions.mission import LinkSettings, Mission, Positioning, Simulation
from missions.world import World
from sitl.dialect import mavlink
from sitl.dynamics.airframe import X500_LIKE, Airframe
from sitl.microservices.outbox import Link
from sitl.open_field import open_field
from sitl.simulator import Simulator
from sitl.wire import LAYOUTS

NAN = math.nan
GCS, COMPANION = (255, 190), (1, 191)
EXACT = Positioning(horizontal_std_m=0.0, vertical_std_m=0.0, velocity_std_m_s=0.0)


def field(
    n_vehicles: int = 1,
    *,
    world: World | None = None,
    positioning: Positioning = EXACT,
    ground_link: LinkSettings | None = None,
    **simulation: Any,
) -> Mission:
    """Open ground, with what a test puts there; the estimators know everything unless it says otherwise."""
    mission = open_field(n_vehicles)
    settings = Simulation(positioning=positioning, ground_link=ground_link or LinkSettings(), **simulation)
    return msgspec.structs.replace(mission, world=world or mission.world, simulation=settings)


@functools.lru_cache(maxsize=4096)
def parsed(frame: bytes) -> Any:
    """The message in a frame."""
    (message,) = mavlink.MAVLink(None).parse_buffer(frame)
    return message


class Flown:
    """One simulator, seen from the ground link and the onboard link of its first vehicle."""

    def __init__(
        self,
        mission: Mission | None = None,
        *,
        seed: int = 1,
        speed: float = 1.0,
        airframe: Airframe = X500_LIKE,
        lidar: bool = False,
    ) -> None:
        self.simulator = Simulator(mission or field(), seed=seed, speed=speed, airframe=airframe, lidar=lidar)
        self._frames: dict[tuple[int, Link], list[bytes]] = {}
        self._codecs = {who: mavlink.MAVLink(None, *who) for who in (GCS, COMPANION)}
        self._setpoint: tuple[Any, int] | None = None
        self._sticks: Any = None
        self.gcs_is_there = False
        """Whether a ground station sends its heartbeats, once a second."""

    # ---------------------------------------------------------------- traffic
    def send(self, message: Any, *, sysid: int = 1, link: Link = Link.GROUND, source: tuple[int, int] | None = None):
        who = source or (GCS if link is Link.GROUND else (sysid, 191))
        codec = self._codecs.setdefault(who, mavlink.MAVLink(None, *who))
        self.simulator.receive(sysid, link, message.pack(codec))
        codec.seq = (codec.seq + 1) % 256
        self._listen()

    def command(
        self, number: int, *params: float, sysid: int = 1, link: Link = Link.GROUND, confirmation: int = 0
    ) -> int | None:
        """Send a COMMAND_LONG; its MAV_RESULT, or None for silence."""
        padded = (*params, *(0.0,) * (7 - len(params)))
        before = len(self.messages("COMMAND_ACK", sysid, link))
        self.send(mavlink.MAVLink_command_long_message(sysid, 1, number, confirmation, *padded), sysid=sysid, link=link)
        self.run(0.04)
        acks = [ack for ack in self.messages("COMMAND_ACK", sysid, link)[before:] if ack.command == number]
        return acks[0].result if acks else None

    def heard(self, link: Link, sysid: int = 1) -> list[bytes]:
        """All frames that have come over a link, in order."""
        return self._frames.get((sysid, link), [])

    def messages(self, kind: str, sysid: int = 1, link: Link = Link.GROUND) -> list[Any]:
        """The messages of one kind that have come over a link, in order."""
        message_id = LAYOUTS[kind].id_bytes
        return [parsed(frame) for frame in self.heard(link, sysid) if frame[7:10] == message_id]

    def last(self, kind: str, sysid: int = 1, link: Link = Link.GROUND) -> Any:
        found = self.messages(kind, sysid, link)
        assert found, f"no {kind} from vehicle {sysid} on the {link.value} link"
        return found[-1]

    def forget(self) -> None:
        self._frames.clear()

    @property
    def texts(self) -> list[str]:
        """STATUSTEXTs on the ground link, chunks put together."""
        texts: list[str] = []
        for m in self.messages("STATUSTEXT"):
            if m.chunk_seq:
                texts[-1] += m.text
            else:
                texts.append(m.text)
        return [text.strip() for text in texts]

    def _listen(self) -> None:
        for sysid, link, frame in self.simulator.transmissions():
            self._frames.setdefault((sysid, link), []).append(frame)

    # ------------------------------------------------------------------- time
    @property
    def time_s(self) -> float:
        return self.simulator.time_s

    def run(self, duration_s: float) -> "Flown":
        for _ in range(round(duration_s / 0.02)):
            if self.gcs_is_there and round(self.time_s / 0.02) % 50 == 0:
                self.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
            if self._sticks is not None:
                self.send(self._sticks)
            if self._setpoint is not None:
                message, sysid = self._setpoint
                self.send(message, sysid=sysid, link=Link.ONBOARD)
            self.simulator.step()
            self._listen()
        return self

    def until(self, holds: Callable[[], bool], timeout_s: float) -> float:
        """Run until something holds; how long that took."""
        begin_s = self.time_s
        while not holds():
            assert self.time_s - begin_s < timeout_s, f"still not after {timeout_s} s: {self.state}"
            self.run(0.02)
        return self.time_s - begin_s

    # ------------------------------------------------------------------ state
    @property
    def position(self) -> np.ndarray:
        """(3,) where vehicle 1 really is, ENU."""
        return self.simulator.truth.position_enu_m[0]

    @property
    def velocity(self) -> np.ndarray:
        return self.simulator.truth.velocity_enu_m_s[0]

    @property
    def height(self) -> float:
        return float(self.position[2])

    @property
    def autopilot(self):
        return self.simulator.vehicles[1].autopilot

    @property
    def mode(self) -> str:
        return self.autopilot.mode.name

    @property
    def armed(self) -> bool:
        return self.autopilot.armed

    @property
    def state(self) -> str:
        return f"{self.time_s:.2f} s, {self.mode}, armed {self.armed}, at {self.position.round(2)}, {self.texts[-3:]}"

    # ----------------------------------------------------------------- flying
    def boot(self) -> "Flown":
        return self.run(1.0)

    def take_off(self, height_m: float = 3.0, sysid: int = 1) -> "Flown":
        """Boot if need be, and hover in Hold at a height."""
        if self.time_s < 1.0:
            self.boot()
        altitude_m = (
            self.last("HOME_POSITION", sysid).altitude / 1e3 if self.messages("HOME_POSITION", sysid) else 489.4
        )
        assert self.command(22, 0, 0, 0, NAN, NAN, NAN, altitude_m + height_m, sysid=sysid) == 0
        assert self.command(400, 1, sysid=sysid) == 0
        autopilot = self.simulator.vehicles[sysid].autopilot
        self.until(lambda: autopilot.mode.name == "HOLD" and not autopilot.snapshot.landed, 60.0)
        return self.run(2.0)

    def stream(
        self,
        position=(NAN, NAN, NAN),
        velocity=(NAN, NAN, NAN),
        acceleration=(NAN, NAN, NAN),
        *,
        yaw: float = 0.0,
        mask: int | None = None,
        frame: int = 1,
        sysid: int = 1,
    ) -> "Flown":
        """Send this setpoint (NED) at every tick from now on; NaN is ignored in the type mask."""
        values = (*position, *velocity, *acceleration)
        if mask is None:
            mask = sum(1 << bit for bit, value in enumerate(values) if math.isnan(value)) | 1 << 11
        numbers = [0.0 if math.isnan(value) else value for value in values]
        message = mavlink.MAVLink_set_position_target_local_ned_message(0, sysid, 1, frame, mask, *numbers, yaw, 0.0)
        self._setpoint = (message, sysid)
        return self

    def go_silent(self) -> "Flown":
        """Stop sending setpoints."""
        self._setpoint = None
        return self

    def hold_sticks(self, *, pitch: int = 0, roll: int = 0, throttle: int = 500, yaw: int = 0) -> "Flown":
        """Send these sticks at every tick from now on, as MANUAL_CONTROL has them."""
        self._sticks = mavlink.MAVLink_manual_control_message(1, pitch, roll, throttle, yaw, 0)
        return self

    def let_go(self) -> "Flown":
        """Stop sending sticks."""
        self._sticks = None
        return self

    def offboard(self) -> "Flown":
        """Switch to Offboard; setpoints must be streaming."""
        self.run(0.1)
        assert self.command(176, 1, 6, link=Link.ONBOARD) == 0
        return self.run(0.1)

    def upload(self, items: list[tuple], *, kind: int = 0, sysid: int = 1, link: Link = Link.GROUND) -> int:
        """Upload items of (frame, command, param1..4, x, y, z); the MAV_MISSION_RESULT."""
        before = len(self.messages("MISSION_ACK", sysid, link))
        self.send(mavlink.MAVLink_mission_count_message(sysid, 1, len(items), kind), sysid=sysid, link=link)
        for seq, item in enumerate(items):
            frame, command, p1, p2, p3, p4, x, y, z = item
            message = mavlink.MAVLink_mission_item_int_message(
                sysid, 1, seq, frame, command, 0, 1, p1, p2, p3, p4, x, y, z, kind
            )
            self.send(message, sysid=sysid, link=link)
        self.run(0.04)
        acks = self.messages("MISSION_ACK", sysid, link)[before:]
        assert acks, "no MISSION_ACK"
        return acks[0].type

    def set_parameter(self, name: str, value: float) -> None:
        """Set a parameter of vehicle 1 directly."""
        parameters = self.autopilot.parameters
        parameters.set(name, int(value) if parameters.is_int(name) else float(value))


def place(north_m: float, east_m: float) -> tuple[int, int]:
    """Latitude and longitude [1e-7 deg] near the open field's origin."""
    latitude = 47.3977432 + math.degrees(north_m / 6_371_000.0)
    longitude = 8.5455942 + math.degrees(east_m / (6_371_000.0 * math.cos(math.radians(47.3977432))))
    return round(latitude * 1e7), round(longitude * 1e7)


def waypoint(north_m: float, east_m: float, up_m: float, *, acceptance_m: float = 0.0, hold_s: float = 0.0) -> tuple:
    x, y = place(north_m, east_m)
    return (6, 16, hold_s, acceptance_m, 0.0, NAN, x, y, up_m)
