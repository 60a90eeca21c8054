"""Putting a plan onto a vehicle with certainty about what is stored: upload, read back, compare, and again if need be.

An upload's own end is uncertain on a lossy link: the final acknowledgement may be lost or forged. What the vehicle
gives out when it is asked decides. Until the last item is taken it keeps its old plan, so there is never half of one.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import Enum

from gcs.dialect import Message
from gcs.errors import MissionTransferError
from gcs.microservices import Microservice
from gcs.microservices.mission_comparison import first_difference
from gcs.microservices.mission_download import MissionDownload
from gcs.microservices.mission_messages import KIND_NAMES, MISSION, MISSION_TURN, LinkEstimate
from gcs.microservices.mission_upload import MissionUpload
from missions.mission_items import MissionItem

ATTEMPTS = 4
REFUSALS = 2
"""A refusal may be forged; two in a row, with nothing of ours stored, are believed."""


class Stage(Enum):
    """What is being done, for the operator."""

    UPLOADING = "uploading"
    READING_BACK = "reading back"
    STORED = "stored"
    FAILED = "failed"


@dataclass
class VerifiedUpload(Microservice):
    """Upload, and end well only when exactly these items are stored.

    Args:
        items: what is to be stored.
        peer: system and component.
        mission_type: MAV_MISSION_TYPE.
        link: what is known of the link beforehand.

    Raises:
        MissionTransferError: says what is stored instead, or that this is not known.
    """

    items: Sequence[MissionItem]
    peer: tuple[int, int]
    mission_type: int = MISSION
    link: LinkEstimate = field(default_factory=LinkEstimate)
    done: bool = False
    deadline_s: float = math.inf
    wants: frozenset[str] = frozenset(
        {"MISSION_REQUEST", "MISSION_REQUEST_INT", "MISSION_ACK", "MISSION_COUNT", "MISSION_ITEM_INT"}
    )
    turn: str | None = MISSION_TURN
    stage: Stage = Stage.UPLOADING
    uploads: int = 0
    items_sent: int = 0
    accepted_s: float = math.nan
    """When the last upload ended."""
    stored_id: int = 0
    """What the vehicle calls the plan that is stored; 0 if it does not say."""

    def __post_init__(self) -> None:
        self._part: MissionUpload | MissionDownload | None = None
        self._refusals: list[str] = []

    @property
    def progress(self) -> float:
        """Share of the items that the vehicle is known to have taken, 0 to 1."""
        if isinstance(self._part, MissionUpload):
            return self._part.taken / max(len(self.items), 1)
        return 1.0 if self.uploads else 0.0

    def start(self, now_s: float) -> list[Message]:
        self.stage = Stage.UPLOADING
        self.uploads += 1
        return self._proceed(MissionUpload(self.items, self.peer, self.mission_type, self.link), now_s)

    def receive(self, message: Message, now_s: float) -> list[Message]:
        part = self._part
        if part is None or self.done or message.get_type() not in part.wants:
            return []
        try:
            messages = part.receive(message, now_s)
        except MissionTransferError as refusal:
            return self._refused(refusal, now_s)
        return messages + self._next(now_s)

    def handle_timeout(self, now_s: float) -> list[Message]:
        assert self._part is not None
        try:
            messages = self._part.handle_timeout(now_s)
        except MissionTransferError as silence:
            self.stage, self.done = Stage.FAILED, True
            raise MissionTransferError(f"{silence}; what is stored is not known") from None
        return messages + self._next(now_s)

    def abandon(self) -> list[Message]:
        """What ends the transfer before its time."""
        return self._part.abandon() if self._part is not None else []

    # ------------------------------------------------------------------ steps
    def _proceed(self, part: MissionUpload | MissionDownload, now_s: float) -> list[Message]:
        self._part = part
        messages = part.start(now_s)
        self.deadline_s = part.deadline_s
        return messages

    def _next(self, now_s: float) -> list[Message]:
        part = self._part
        assert part is not None
        self.deadline_s = part.deadline_s
        if not part.done:
            return []
        self.link = part.learned
        if isinstance(part, MissionDownload):
            return self._judge(part, now_s)
        self.items_sent += part.items_sent
        self.accepted_s = now_s
        return self._read_back(now_s)

    def _read_back(self, now_s: float) -> list[Message]:
        self.stage = Stage.READING_BACK
        return self._proceed(MissionDownload(self.peer, self.mission_type, self.link), now_s)

    def _judge(self, found: MissionDownload, now_s: float) -> list[Message]:
        difference = first_difference(self.items, found.items, self.mission_type)
        if not difference:
            self.stage, self.done, self.stored_id = Stage.STORED, True, found.opaque_id
            return []
        if self.uploads < ATTEMPTS and len(self._refusals) < REFUSALS:
            return self.start(now_s)
        self.stage, self.done = Stage.FAILED, True
        because = self._refusals[-1] if self._refusals else f"{self}: after {self.uploads} uploads"
        raise MissionTransferError(f"{because}; stored is something else: {difference}")

    def _refused(self, refusal: MissionTransferError, now_s: float) -> list[Message]:
        if isinstance(self._part, MissionDownload):
            self.stage, self.done = Stage.FAILED, True
            raise MissionTransferError(f"{refusal}; what is stored is not known") from None
        assert self._part is not None
        self.items_sent += self._part.items_sent
        self._refusals.append(str(refusal))
        return self._read_back(now_s)

    def __str__(self) -> str:
        return f"vehicle {self.peer[0]}: {KIND_NAMES[self.mission_type]} upload"
