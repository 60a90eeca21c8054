"""The mission protocol's vehicle side on one link: missions, fences and rally points, up and down.

PX4's rules: items are asked for one by one and again after a quarter of a second, five seconds of silence end an upload
and keep the old plan, one upload at a time over both links, ids are CRCs of what is stored.
"""

import math
from dataclasses import dataclass, field
from enum import IntEnum

from missions.mission_items import MissionItem
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.plan import Plan
from sitl.autopilot.reports import Say, Severity
from sitl.dialect import Message, mavlink
from sitl.microservices.mission_item_codec import (
    ItemRefused,
    float_item,
    int_item,
    read_float_item,
    read_int_item,
)
from sitl.microservices.outbox import Link, Outbox, Sender
from sitl.wire import LAYOUTS

RETRY_S = 0.25
TIMEOUT_S = 5.0


class MissionType(IntEnum):
    """MAV_MISSION_TYPE."""

    MISSION = 0
    FENCE = 1
    RALLY = 2


MOST_ITEMS = {MissionType.MISSION: 32767, MissionType.FENCE: 64, MissionType.RALLY: 32}


class PlanStore:
    """The three plans of a vehicle, shared by its links; one upload at a time."""

    def __init__(self, autopilot: Autopilot) -> None:
        self._autopilot = autopilot
        self.uploading: Link | None = None

    def plan(self, kind: MissionType) -> Plan:
        autopilot = self._autopilot
        return {
            MissionType.MISSION: autopilot.navigator.mission.plan,
            MissionType.FENCE: autopilot.fence.plan,
            MissionType.RALLY: autopilot.rally,
        }[kind]

    def store(self, kind: MissionType, items: tuple[MissionItem, ...]) -> None:
        plan = Plan(items)
        if kind is MissionType.MISSION:
            self._autopilot.set_mission(plan)
        elif kind is MissionType.FENCE:
            self._autopilot.set_fence(plan)
        else:
            self._autopilot.set_rally(plan)


@dataclass
class _Upload:
    sender: Sender
    kind: MissionType
    count: int
    received_s: float
    asked_s: float = -math.inf
    items: list[MissionItem] = field(default_factory=list[MissionItem])


@dataclass
class _Download:
    sender: Sender
    kind: MissionType
    count: int
    received_s: float
    next_seq: int = 0


class MissionTransferServer:
    """Uploads and downloads over one link.

    Args:
        link: the link.
        store: the vehicle's plans.
        autopilot: whose mission's current item can be set.
        outbox: where answers go.
        say: where complaints go.
        speed: simulated seconds per wall-clock second; the timeouts are the wall clock's.
    """

    def __init__(
        self, link: Link, store: PlanStore, autopilot: Autopilot, outbox: Outbox, say: Say, speed: float
    ) -> None:
        self._link = link
        self._store = store
        self._autopilot = autopilot
        self._outbox = outbox
        self._say = say
        self._speed = speed
        self._upload: _Upload | None = None
        self._download: _Download | None = None
        self._asks_int = False
        """PX4 asks with MISSION_REQUEST until it has seen an _INT message."""

    # ----------------------------------------------------------------- upload
    def receive_count(self, message: Message, sender: Sender, now_s: float) -> None:
        """MISSION_COUNT: an upload begins, or a client has not heard our first request."""
        upload = self._upload
        if upload is not None:
            upload.received_s = now_s
            if sender != upload.sender:
                self._acknowledge(sender, mavlink.MAV_MISSION_ERROR, message.mission_type)
            elif upload.items:
                self._say(Severity.CRITICAL, "WPM: REJ. CMD: Busy")
                self._acknowledge(sender, mavlink.MAV_MISSION_ERROR, message.mission_type)
            else:
                self._begin_upload(message, sender, now_s)
        elif self._download is not None and not self._sent_all(self._download):
            self._say(Severity.CRITICAL, "WPM: IGN MISSION_COUNT: Busy")
            self._acknowledge(sender, mavlink.MAV_MISSION_ERROR, message.mission_type)
        elif self._store.uploading is not None:
            self._acknowledge(sender, mavlink.MAV_MISSION_ERROR, message.mission_type)
        else:
            self._begin_upload(message, sender, now_s)

    def _begin_upload(self, message: Message, sender: Sender, now_s: float) -> None:
        self._end_upload()
        self._download = None
        if message.mission_type not in set(MissionType):
            self._acknowledge(sender, mavlink.MAV_MISSION_ERROR, MissionType.MISSION)
            return
        kind = MissionType(message.mission_type)
        if message.count > MOST_ITEMS[kind]:
            self._acknowledge(sender, mavlink.MAV_MISSION_NO_SPACE, kind)
        elif message.count == 0:
            self._store.store(kind, ())
            self._acknowledge(sender, mavlink.MAV_MISSION_ACCEPTED, kind)
        else:
            self._store.uploading = self._link
            self._upload = _Upload(sender, kind, message.count, now_s)
            self._ask(self._upload, now_s)

    def receive_item_int(self, message: Message, sender: Sender, now_s: float) -> None:
        self._asks_int = True
        self._receive_item(message, sender, now_s)

    def receive_item(self, message: Message, sender: Sender, now_s: float) -> None:
        self._asks_int = False
        self._receive_item(message, sender, now_s)

    def _receive_item(self, message: Message, sender: Sender, now_s: float) -> None:
        upload = self._upload
        if upload is None:
            self._say(Severity.CRITICAL, "IGN MISSION_ITEM: No transfer")
            self._acknowledge(sender, mavlink.MAV_MISSION_ERROR, message.mission_type)
            return
        if sender != upload.sender:
            return
        upload.received_s = now_s
        if message.mission_type != upload.kind:
            self._fail(upload, mavlink.MAV_MISSION_ERROR)
        elif message.seq == len(upload.items):
            self._take(upload, message, now_s)

    def _take(self, upload: _Upload, message: Message, now_s: float) -> None:
        """The item that was expected: keep it, and ask for the next or end."""
        read = read_int_item if message.get_type() == "MISSION_ITEM_INT" else read_float_item
        try:
            upload.items.append(read(message, upload.kind))
        except ItemRefused as refused:
            self._say(Severity.CRITICAL, "IGN MISSION_ITEM: Invalid item")
            self._fail(upload, refused.result)
            return
        if len(upload.items) < upload.count:
            self._ask(upload, now_s)
            return
        self._end_upload()
        self._store.store(upload.kind, tuple(upload.items))
        self._acknowledge(upload.sender, mavlink.MAV_MISSION_ACCEPTED, upload.kind)

    def _ask(self, upload: _Upload, now_s: float) -> None:
        upload.asked_s = now_s
        request = (
            mavlink.MAVLink_mission_request_int_message if self._asks_int else mavlink.MAVLink_mission_request_message
        )
        sender = upload.sender
        self._outbox.send(self._link, request(sender.sysid, sender.compid, len(upload.items), upload.kind))

    def _fail(self, upload: _Upload, result: int) -> None:
        self._end_upload()
        self._acknowledge(upload.sender, result, upload.kind)

    def _end_upload(self) -> None:
        if self._upload is not None:
            self._upload = self._store.uploading = None

    # --------------------------------------------------------------- download
    def receive_request_list(self, message: Message, sender: Sender, now_s: float) -> None:
        """MISSION_REQUEST_LIST: a download begins, or begins again."""
        download = self._download
        mine = download is not None and download.sender == sender and download.kind == message.mission_type
        busy = self._upload is not None or (download is not None and not mine and not self._sent_all(download))
        if busy:
            self._say(Severity.INFO, "Mission download request ignored, already active")
            return
        known = message.mission_type in set(MissionType)
        plan = self._store.plan(MissionType(message.mission_type)) if known else Plan()
        if known:
            kind = MissionType(message.mission_type)
            self._download = _Download(sender, kind, len(plan.items), now_s)
        count = len(plan.items), message.mission_type, plan.plan_id
        self._outbox.send_values(self._link, LAYOUTS["MISSION_COUNT"], (sender.sysid, sender.compid, *count))

    def receive_request_int(self, message: Message, sender: Sender, now_s: float) -> None:
        self._asks_int = True
        self._receive_request(message, sender, now_s, as_int=True)

    def receive_request(self, message: Message, sender: Sender, now_s: float) -> None:
        self._asks_int = False
        self._receive_request(message, sender, now_s, as_int=False)

    def _receive_request(self, message: Message, sender: Sender, now_s: float, *, as_int: bool) -> None:
        """The next item, or the last one once more; anything else ends the download."""
        download = self._download
        if download is None or download.sender != sender or download.kind != message.mission_type:
            return
        download.received_s = now_s
        seq: int = message.seq
        items = self._store.plan(download.kind).items
        expected = seq in (download.next_seq, download.next_seq - 1) and seq < download.count
        if not expected or seq >= len(items):
            self._download = None
            self._say(Severity.CRITICAL, "WPM: REJ. CMD: Req. WP was unexpected")
            self._acknowledge(sender, mavlink.MAV_MISSION_ERROR, download.kind)
            return
        download.next_seq = seq + 1
        write = int_item if as_int else float_item
        self._outbox.send(self._link, write(items[seq], seq, sender, download.kind))

    def _sent_all(self, download: _Download) -> bool:
        return download.next_seq >= download.count

    # ------------------------------------------------------------------ other
    def receive_ack(self, message: Message, sender: Sender, now_s: float) -> None:
        """MISSION_ACK from the client: ends its download, cancels its upload, or wants to be asked otherwise."""
        if self._download is not None and self._download.sender == sender:
            self._download = None
        upload = self._upload
        if upload is None or upload.sender != sender:
            return
        if message.type == mavlink.MAV_MISSION_OPERATION_CANCELLED:
            self._end_upload()
        elif message.type == mavlink.MAV_MISSION_UNSUPPORTED:  # the client speaks the other kind of items
            self._asks_int = not self._asks_int
            self._ask(upload, now_s)

    def receive_clear_all(self, message: Message, sender: Sender) -> None:
        """MISSION_CLEAR_ALL: one type, or all."""
        if self._upload is not None or self._store.uploading is not None:
            self._say(Severity.CRITICAL, "WPM: CLEAR CMD: Busy")
            return
        everything = message.mission_type == mavlink.MAV_MISSION_TYPE_ALL
        for kind in MissionType:
            if everything or message.mission_type == kind:
                self._store.store(kind, ())
        self._acknowledge(sender, mavlink.MAV_MISSION_ACCEPTED, message.mission_type)

    def receive_set_current(self, message: Message) -> None:
        """MISSION_SET_CURRENT; the answer is the MISSION_CURRENT that its change sends."""
        if self._upload is not None:
            self._say(Severity.CRITICAL, "WPM: IGN WP CURR CMD: Busy")
        elif not self._autopilot.navigator.mission.set_current(message.seq):
            self._say(Severity.CRITICAL, "WPM: WP CURR CMD: Not in list")

    def tick(self, now_s: float) -> None:
        """Ask again, give up."""
        if self._download is not None and now_s - self._download.received_s > TIMEOUT_S * self._speed:
            self._download = None
        upload = self._upload
        if upload is None:
            return
        if now_s - upload.received_s > TIMEOUT_S * self._speed:
            self._end_upload()
            self._say(Severity.CRITICAL, "Operation timeout")
        elif now_s - upload.asked_s > RETRY_S * self._speed:
            self._ask(upload, now_s)

    def _acknowledge(self, sender: Sender, result: int, kind: int) -> None:
        plan_id = self._store.plan(MissionType(kind)).plan_id if kind in set(MissionType) else 0
        accepted = result == mavlink.MAV_MISSION_ACCEPTED
        answer = sender.sysid, sender.compid, result, kind, plan_id if accepted else 0
        self._outbox.send_values(self._link, LAYOUTS["MISSION_ACK"], answer)
