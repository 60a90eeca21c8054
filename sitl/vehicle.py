"""One vehicle: its autopilot, its MAVLink services, and its two links. No socket, no wall clock."""

from collections.abc import Callable

import numpy as np

from missions.mission import Positioning
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.flight_control import FlightControl
from sitl.autopilot.memory import Memory
from sitl.autopilot.parameter_table import parameter_table
from sitl.autopilot.places import GlobalPoint, OwnFrame
from sitl.autopilot.reports import Severity
from sitl.dialect import Message
from sitl.dynamics.airframe import Airframe
from sitl.fleet import TICK_S
from sitl.microservices.absent_services import AbsentServices
from sitl.microservices.clock import ClockServer
from sitl.microservices.command_server import CommandServer
from sitl.microservices.commands import HANDLERS
from sitl.microservices.mission_progress import MissionProgress
from sitl.microservices.mission_transfer_server import MissionTransferServer, PlanStore
from sitl.microservices.outbox import Link, Outbox, Sender
from sitl.microservices.parameter_server import ParameterServer
from sitl.microservices.peers import Peers
from sitl.microservices.router import Router
from sitl.microservices.setpoint_server import SetpointServer
from sitl.microservices.signing import Signing
from sitl.microservices.statustext import StatusTexts
from sitl.microservices.streams import Streams
from sitl.microservices.telemetry import Moment, Surroundings
from sitl.snapshot import Snapshot, is_broken
from sitl.wire import FrameReader

Handler = Callable[[Message, Sender], None]


class Vehicle:
    """An autopilot behind its links.

    Args:
        sysid: MAVLink system id.
        body: the vehicle's record in the fleet, dtype `VEHICLE`.
        gains: its record of dtype `GAINS`.
        airframe: for the defaults of its parameters.
        positioning: how well it knows where it is, for what it says of that.
        speed: simulated seconds per wall-clock second.
        utc_start_us: UTC at boot, on simulated time.
        wall_start_us: UTC at boot, on the wall clock that `speed` makes of it.
        first_view: what the autopilot sees before the first tick.
        memory: what it has kept from before this boot.
    """

    def __init__(
        self,
        *,
        sysid: int,
        body: np.void,
        gains: np.void,
        airframe: Airframe,
        positioning: Positioning,
        speed: float,
        utc_start_us: int,
        wall_start_us: int,
        first_view: Snapshot,
        memory: Memory,
    ) -> None:
        self.sysid = sysid
        self._body = body
        self._utc_start_us = utc_start_us
        self._positioning = positioning
        self.outbox = Outbox(sysid)
        self._texts = StatusTexts(self.outbox)
        self._progress = MissionProgress(self.outbox)
        self.autopilot = Autopilot(
            FlightControl(body, gains),
            _own_frame(body),
            parameter_table(airframe),
            speed,
            self._texts.say,
            self._progress.reached,
            memory,
        )
        self._now_s = 0.0
        self._snapshot = first_view
        self._crash = first_view.crash
        self._readers = {link: FrameReader() for link in Link}
        self._router = Router(sysid)
        self._signing = Signing(memory.signing, wall_start_us, speed)
        self._streams = {link: Streams(link, self.outbox, TICK_S) for link in Link}
        self.surroundings: Surroundings | None = None
        """What the range sensor has seen last, for OBSTACLE_DISTANCE; None without such a sensor."""
        self._make_services(speed)
        self.autopilot.tick(first_view, 0.0, 0.0)
        self.autopilot.remember()

    def _make_services(self, speed: float) -> None:
        autopilot, outbox, say = self.autopilot, self.outbox, self._texts.say
        self._peers = Peers(autopilot.parameters, say, speed)
        self._parameters = ParameterServer(autopilot.parameters, outbox)
        store = PlanStore(autopilot)
        self._transfers = {link: MissionTransferServer(link, store, autopilot, outbox, say, speed) for link in Link}
        self._commands = CommandServer(autopilot, outbox, self._streams, self._moment, say, speed, HANDLERS)
        self._setpoints = SetpointServer(autopilot)
        self._clock = ClockServer(outbox)
        self._absent = AbsentServices(outbox)
        self._targeted = self._targeted_handlers()
        self._untargeted: dict[str, Handler] = {
            "HEARTBEAT": lambda m, s: self._peers.receive_heartbeat(m, self._now_s),
            "MANUAL_CONTROL": lambda m, s: self._receive_sticks(m),
            "FOLLOW_TARGET": lambda m, s: self._setpoints.receive_follow_target(m, self._now_s),
            "TIMESYNC": lambda m, s: self._clock.receive_timesync(m, s, self._now_s),
            "PING": lambda m, s: self._clock.receive_ping(m, s, self._now_s),
        }

    def _targeted_handlers(self) -> dict[str, Handler]:
        """Message -> who deals with it, for messages that are addressed to this autopilot."""
        commands, setpoints, parameters, transfers = (
            self._commands,
            self._setpoints,
            self._parameters,
            self._transfers,
        )
        return {
            "COMMAND_LONG": lambda m, s: commands.receive_long(m, s, self._now_s),
            "COMMAND_INT": lambda m, s: commands.receive_int(m, s, self._now_s),
            "SET_MODE": lambda m, s: commands.receive_set_mode(m, s, self._now_s),
            "SET_POSITION_TARGET_LOCAL_NED": lambda m, s: setpoints.receive_local(m, self._now_s),
            "SET_POSITION_TARGET_GLOBAL_INT": lambda m, s: setpoints.receive_global(m, self._now_s),
            "SET_ATTITUDE_TARGET": lambda m, s: setpoints.receive_attitude(m, self._now_s),
            "SETUP_SIGNING": self._signing.receive_setup,
            "FILE_TRANSFER_PROTOCOL": self._absent.receive_file_request,
            "LOG_REQUEST_LIST": self._absent.receive_log_request,
            "PARAM_REQUEST_LIST": self._by_name(parameters.receive_list),
            "PARAM_REQUEST_READ": self._by_name(parameters.receive_read),
            "PARAM_SET": self._by_name(parameters.receive_set),
            "SET_GPS_GLOBAL_ORIGIN": lambda m, s: self._tell_origin(s),
            "MISSION_COUNT": lambda m, s: transfers[s.link].receive_count(m, s, self._now_s),
            "MISSION_ITEM_INT": lambda m, s: transfers[s.link].receive_item_int(m, s, self._now_s),
            "MISSION_ITEM": lambda m, s: transfers[s.link].receive_item(m, s, self._now_s),
            "MISSION_REQUEST_LIST": lambda m, s: transfers[s.link].receive_request_list(m, s, self._now_s),
            "MISSION_REQUEST_INT": lambda m, s: transfers[s.link].receive_request_int(m, s, self._now_s),
            "MISSION_REQUEST": lambda m, s: transfers[s.link].receive_request(m, s, self._now_s),
            "MISSION_ACK": lambda m, s: transfers[s.link].receive_ack(m, s, self._now_s),
            "MISSION_CLEAR_ALL": lambda m, s: transfers[s.link].receive_clear_all(m, s),
            "MISSION_SET_CURRENT": lambda m, s: transfers[s.link].receive_set_current(m),
        }

    def _tell_origin(self, sender: Sender) -> None:
        """Who wants another origin is told which one it is: it lies where the estimator started."""
        self._streams[sender.link].send_now("GPS_GLOBAL_ORIGIN", self._moment())

    def _by_name(self, handler: Handler) -> Handler:
        """Only for messages to this very system: parameters are not set by whoever speaks to everybody."""
        return lambda m, s: handler(m, s) if m.target_system == self.sysid else None

    # ------------------------------------------------------------------ state
    @property
    def dropped(self) -> int:
        """Frames that could not be read, or were not signed as they must be, on both links."""
        return self._signing.refused + sum(reader.dropped for reader in self._readers.values())

    def set_clock(self, by_s: float) -> None:
        """UTC, as the autopilot has it, jumps; time since boot goes on."""
        self._utc_start_us += round(by_s * 1e6)

    # ---------------------------------------------------------------- traffic
    def receive(self, link: Link, datagram: bytes) -> None:
        """Take in one datagram; never raises because of what is in it."""
        for message in self._readers[link].read(datagram):
            sender = Sender(link, message.get_srcSystem(), message.get_srcComponent())
            frame, is_signed = bytes(message.get_msgbuf()), link is Link.GROUND and self._signing.is_on
            if is_signed and not self._signing.accepts(frame, sender, self._now_s):
                continue
            if self._router.forwards(message, sender):
                self.outbox.forward(link.other, self._signing.stripped(frame) if is_signed else frame)
            self._handle(message, sender)

    def take(self) -> list[tuple[Link, bytes]]:
        """The frames to be sent, in order; those for the ground are signed if there is a key."""
        frames = self.outbox.take()
        if not self._signing.is_on:
            return frames
        signed = [(link, self._signing.sign(f, self._now_s) if link is Link.GROUND else f) for link, f in frames]
        return [(link, frame) for link, frame in signed if frame is not None]

    def _handle(self, message: Message, sender: Sender) -> None:
        kind = message.get_type()
        handler = self._untargeted.get(kind)
        if handler is None and self._router.is_for_autopilot(message):
            handler = self._targeted.get(kind)
        if handler is not None:
            handler(message, sender)

    def _receive_sticks(self, message: Message) -> None:
        m = message
        if m.target == self.sysid:
            self.autopilot.sticks.receive(m.x, m.y, m.z, m.r, self._now_s)

    # ------------------------------------------------------------------- tick
    def tick(self, snapshot: Snapshot, now_s: float, dt_s: float) -> None:
        """Look at the world after a step of it, decide, and speak."""
        self._snapshot, self._now_s = snapshot, now_s
        self.autopilot.gcs_lost = self._peers.gcs_lost(now_s)
        self._texts.listener = self._peers.gcs_listens(now_s)
        self._peers.update(now_s)
        self.autopilot.tick(snapshot, now_s, dt_s)
        if snapshot.crash != self._crash:
            self._crash = snapshot.crash
            self._texts.say(Severity.CRITICAL, "Collision: rotors lost" if is_broken(snapshot) else "Hard landing")
        self._texts.flush()
        self._parameters.tick()
        for transfer in self._transfers.values():
            transfer.tick(now_s)
        moment = self._moment()
        self._progress.tick(moment, self._streams)
        for stream in self._streams.values():
            stream.tick(moment)

    def _moment(self) -> Moment:
        utc_us = self._utc_start_us + round(self._now_s * 1e6)
        return Moment(
            self.autopilot,
            self._snapshot,
            self._now_s,
            utc_us,
            self._positioning,
            self.sysid,
            self._body,
            self.surroundings,
        )


def _own_frame(body: np.void) -> OwnFrame:
    return OwnFrame(
        GlobalPoint(
            float(np.degrees(body["origin_latitude_rad"])),
            float(np.degrees(body["origin_longitude_rad"])),
            float(body["origin_altitude_m"]),
        )
    )
