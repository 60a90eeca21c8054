"""The mission protocol's vocabulary, the ground station's side: types of plans, and items on the wire."""

from dataclasses import dataclass

from gcs.dialect import Message, mavlink
from gcs.microservices.round_trip import LossEstimate, RoundTrip
from missions.mission_items import MissionItem

MISSION = mavlink.MAV_MISSION_TYPE_MISSION
FENCE = mavlink.MAV_MISSION_TYPE_FENCE
RALLY = mavlink.MAV_MISSION_TYPE_RALLY
KIND_NAMES = {MISSION: "mission", FENCE: "fence", RALLY: "rally points"}

MISSION_TURN = "mission"
"""A vehicle takes part in one transfer at a time."""
MOST_IN_FLIGHT = 16
"""Frames under way at once, copies included: 0.8 kB of items."""
TWO_COPIES_FROM, THREE_COPIES_FROM = 0.25, 0.45
"""Loss from which a frame is sent more than once at a time: fewer round trips for the same number of frames."""
FORGOTTEN_AFTER_S = 5.0
"""A PX4 forgets a transfer after so much silence, says nothing to what belongs to it, and keeps the old plan."""
MAX_ITEMS = 10_000

PASSING_RESULTS = frozenset(
    {
        mavlink.MAV_MISSION_ACCEPTED,
        mavlink.MAV_MISSION_ERROR,
        mavlink.MAV_MISSION_INVALID_SEQUENCE,
        mavlink.MAV_MISSION_OPERATION_CANCELLED,
    }
)
"""Acknowledgements that may be about something else: a PX4 answers a straggling item, or a repeated MISSION_COUNT, with
ERROR, also while the present transfer is going well. What counts is whether the transfer goes on.
"""


@dataclass(frozen=True)
class LinkEstimate:
    """What is known of a link before a transfer, and better known after it."""

    round_trip_s: float | None = None
    loss: float = 0.0
    variation_s: float | None = None
    """Of the round trip; None where one sample is all that there is."""

    def round_trip(self) -> RoundTrip:
        known_s, variation_s = self.round_trip_s, self.variation_s
        if known_s is None:
            return RoundTrip()
        return RoundTrip(known_s, known_s / 4 if variation_s is None else variation_s)

    def loss_estimate(self) -> LossEstimate:
        return LossEstimate(self.loss, 10 if self.loss else 0)


def copies_at(loss: float) -> int:
    """In how many copies a frame is sent at once on a link that loses this share."""
    return 1 + (loss >= TWO_COPIES_FROM) + (loss >= THREE_COPIES_FROM)


def item_message(item: MissionItem, seq: int, peer: tuple[int, int], mission_type: int) -> Message:
    """MISSION_ITEM_INT number `seq` to a component."""
    current, autocontinue = int(seq == 0 and mission_type == MISSION), 1
    where = (item.frame, item.command, current, autocontinue)
    params = (item.param1, item.param2, item.param3, item.param4, item.x, item.y, item.z)
    return mavlink.MAVLink_mission_item_int_message(*peer, seq, *where, *params, mission_type)


def item_content(message: Message) -> MissionItem:
    """What a received MISSION_ITEM_INT says."""
    return MissionItem(
        command=message.command,
        frame=message.frame,
        param1=message.param1,
        param2=message.param2,
        param3=message.param3,
        param4=message.param4,
        x=message.x,
        y=message.y,
        z=message.z,
    )
