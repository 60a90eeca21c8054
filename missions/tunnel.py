"""Payloads of MAVLink TUNNEL messages between our own programs; docs/mavlink.md has their table.

Little-endian structs with a version byte in front. Decoders take bytes from outside: whatever is wrong with them
raises `WireFormatError`, nothing else.
"""

import struct
from enum import IntEnum

import msgspec
import numpy as np

from missions.errors import WireFormatError
from missions.trajectory import Trajectory

VERSION = 1
TRAJECTORY_VERSION = 2
MAX_PAYLOAD_BYTES = 128


class PayloadType(IntEnum):
    """Private values of MAV_TUNNEL_PAYLOAD_TYPE."""

    TRAJECTORY = 0x8051
    COMPANION_STATUS = 0x8052
    OCCUPANCY = 0x8053
    """Its codec is `missions.occupancy`."""
    RECEIPT = 0x8054
    """Down: how much of what a companion sends has arrived."""


class TrajectoryKind(IntEnum):
    """What a vehicle says of a trajectory that it announces."""

    OPTIMISED = 0
    """Not flown yet: told to the others first, who may object by what they fly."""
    COMMITTED = 1
    BRAKING = 2
    WANTED = 3
    """What it would fly if those who yield to it were not in its way."""


class CompanionState(IntEnum):
    """Where a companion is in its flight; docs/companion.md draws the transitions."""

    CONNECTING = 0
    WAITING = 1
    READY = 2
    ENGAGING = 3
    FLYING = 4
    LANDING = 5
    HOLDING = 6
    FINISHED = 7
    RELEASED = 8
    FAILED = 9


class Reason(IntEnum):
    """Why a companion is in its state."""

    NONE = 0
    NO_MISSION = 1
    MISSION_NOT_UNDERSTOOD = 2
    NO_POSITION = 3
    TARGET_REACHED = 4
    CONTROL_TAKEN = 5
    """A mode change that the companion did not ask for."""
    OFFBOARD_REFUSED = 6
    NO_PATH = 7
    STOPPED_BY_OPERATOR = 8
    AUTOPILOT_LOST = 9
    INTERNAL_ERROR = 10
    NOT_AIRBORNE = 11
    """On the ground or disarmed: companions take over from hovering."""
    NO_SENSOR = 12
    """The range sensor is not heard: whoever cannot see does not move."""


class TrajectoryMessage(msgspec.Struct, frozen=True, kw_only=True):
    """A trajectory that a vehicle flies or wants to fly: 44 bytes of header, then int16 centimetres.

    Positions are mission ENU [m]; times are UTC [s], since vehicles share no other clock.
    """

    kind: TrajectoryKind
    plan_id: int
    revision: int
    radius_m: float
    trajectory: Trajectory
    """Its `start_s` is UTC [s]."""
    announced_s: float = 0.0
    """When it was first told to the others, UTC [s], to a millisecond: earlier ones go first."""
    age_s: float = 0.0
    """How long after that this copy was sent; up to 65 s."""
    rank: int = 0
    """Who yields: the smaller goes first. A vehicle that makes way for another one has that one's rank; 0 for none."""


class CompanionStatus(msgspec.Struct, frozen=True, kw_only=True):
    """A companion's report, sent at 5 Hz of vehicle time and at every change of state."""

    state: CompanionState
    reason: Reason = Reason.NONE
    mission_digest: int = 0
    """`Mission.digest` of the mission file that this companion has read."""
    plan_id: int = 0
    """`mission_items.plan_id` of the mission that it flies or would fly."""
    track_index: int = 0
    replans: int = 0
    replan_p50_ms: float = 0.0
    replan_p99_ms: float = 0.0
    tracking_error_p99_m: float = 0.0
    tick_lateness_max_ms: float = 0.0
    time_boot_ms: int = 0


class Receipt(msgspec.Struct, frozen=True, kw_only=True):
    """A ground station's word on what it hears of a companion, once a second of its clock.

    Both ends count occupancy messages from wherever they began, so only differences mean something.
    """

    heard: int
    """Occupancy messages so far, modulo `RECEIPT_COUNTS`."""
    time_boot_ms: int
    """Of the newest status that was heard."""
    age_s: float
    """How long ago that was, on the ground station's clock; up to 65 s."""


RECEIPT_COUNTS = 2**16
_TRAJECTORY = struct.Struct("<BBBBIIQiiiIHiH")
_POINT = struct.Struct("<hhh")
_STATUS = struct.Struct("<BBBxIIHHHHHHI")
_RECEIPT = struct.Struct("<BxHIH")
MOST_POINTS = (MAX_PAYLOAD_BYTES - _TRAJECTORY.size) // _POINT.size
"""Control points of a trajectory that fit into a payload."""
_TIME_UNIT_S = 1e-4
_FURTHEST_ANNOUNCED = 2**31 - 1
_CM = 100.0


def encode_trajectory(message: TrajectoryMessage) -> bytes:
    """The payload of a TRAJECTORY message.

    Raises:
        ValueError: more control points than fit, or points farther than 327 m from the first one.
    """
    points_cm = np.rint(message.trajectory.control_points_m * _CM).astype(np.int64)
    relative_cm = points_cm - points_cm[0]
    if _TRAJECTORY.size + len(points_cm) * _POINT.size > MAX_PAYLOAD_BYTES or np.abs(relative_cm).max() > 32767:
        raise ValueError(f"{len(points_cm)} control points over {np.abs(relative_cm).max() / _CM:.0f} m do not fit")
    trajectory = message.trajectory
    announced = round((message.announced_s - trajectory.start_s) / _TIME_UNIT_S)
    header = _TRAJECTORY.pack(
        TRAJECTORY_VERSION,
        message.kind,
        len(points_cm),
        message.rank,
        message.plan_id,
        message.revision,
        round(trajectory.start_s * 1e6),
        *points_cm[0].tolist(),
        round(trajectory.knot_interval_s / _TIME_UNIT_S),
        _clipped(message.radius_m * _CM),
        min(max(announced, -_FURTHEST_ANNOUNCED), _FURTHEST_ANNOUNCED),
        _clipped(message.age_s * 1e3),
    )
    return header + relative_cm.astype("<i2").tobytes()


def decode_trajectory(payload: bytes) -> TrajectoryMessage:
    """The message in a TRAJECTORY payload.

    Raises:
        WireFormatError: wrong version, length, kind or content.
    """
    fields = _unpack(_TRAJECTORY, payload)
    version, kind, count, rank, plan, revision, start_us, east, north, up, knot, radius, announced, age_ms = fields
    body = payload[_TRAJECTORY.size : _TRAJECTORY.size + count * _POINT.size]
    if version != TRAJECTORY_VERSION or kind not in set(TrajectoryKind) or count < 4 or knot == 0:
        raise WireFormatError(f"trajectory: version {version}, kind {kind}, {count} points, knot interval {knot}")
    if len(body) != count * _POINT.size:
        raise WireFormatError(f"trajectory: expected {count * _POINT.size} bytes of points, found {len(body)}")
    relative_cm = np.frombuffer(body, dtype="<i2").reshape(-1, 3)
    points_m = (relative_cm + np.array([east, north, up], dtype=float)) / _CM
    return TrajectoryMessage(
        kind=TrajectoryKind(kind),
        plan_id=plan,
        revision=revision,
        radius_m=radius / _CM,
        trajectory=Trajectory(points_m, start_us / 1e6, knot * _TIME_UNIT_S),
        announced_s=round(start_us / 1e6 + announced * _TIME_UNIT_S, 3),
        age_s=age_ms / 1e3,
        rank=rank,
    )


def encode_status(status: CompanionStatus) -> bytes:
    """The payload of a COMPANION_STATUS message; figures too large for their field are sent as its maximum."""
    return _STATUS.pack(
        VERSION,
        status.state,
        status.reason,
        status.mission_digest,
        status.plan_id,
        _clipped(status.track_index),
        _clipped(status.replans),
        _clipped(status.replan_p50_ms * 100.0),
        _clipped(status.replan_p99_ms * 100.0),
        _clipped(status.tracking_error_p99_m * 1000.0),
        _clipped(status.tick_lateness_max_ms * 10.0),
        status.time_boot_ms & 0xFFFFFFFF,
    )


def decode_status(payload: bytes) -> CompanionStatus:
    """The message in a COMPANION_STATUS payload.

    Raises:
        WireFormatError: wrong version, length, state or reason.
    """
    version, state, reason, digest, plan, index, replans, p50, p99, tracking, late, boot_ms = _unpack(_STATUS, payload)
    if version != VERSION or state not in set(CompanionState) or reason not in set(Reason):
        raise WireFormatError(f"companion status: version {version}, state {state}, reason {reason}")
    return CompanionStatus(
        state=CompanionState(state),
        reason=Reason(reason),
        mission_digest=digest,
        plan_id=plan,
        track_index=index,
        replans=replans,
        replan_p50_ms=p50 / 100.0,
        replan_p99_ms=p99 / 100.0,
        tracking_error_p99_m=tracking / 1000.0,
        tick_lateness_max_ms=late / 10.0,
        time_boot_ms=boot_ms,
    )


def encode_receipt(receipt: Receipt) -> bytes:
    """The payload of a RECEIPT message."""
    age_ms = _clipped(receipt.age_s * 1e3)
    return _RECEIPT.pack(VERSION, receipt.heard % RECEIPT_COUNTS, receipt.time_boot_ms & 0xFFFFFFFF, age_ms)


def decode_receipt(payload: bytes) -> Receipt:
    """The message in a RECEIPT payload.

    Raises:
        WireFormatError: wrong version or length.
    """
    version, heard, time_boot_ms, age_ms = _unpack(_RECEIPT, payload)
    if version != VERSION:
        raise WireFormatError(f"receipt: version {version}, expected {VERSION}")
    return Receipt(heard=heard, time_boot_ms=time_boot_ms, age_s=age_ms / 1e3)


def _unpack(layout: struct.Struct, payload: bytes) -> tuple[int, ...]:
    if len(payload) < layout.size:
        raise WireFormatError(f"expected at least {layout.size} bytes, found {len(payload)}")
    return layout.unpack_from(payload)


def _clipped(value: float) -> int:
    return int(min(max(round(value), 0), 0xFFFF))
