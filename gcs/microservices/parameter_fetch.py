"""All parameters of a vehicle, from a kept copy where its `_HASH_CHECK` says that nothing has changed.

PX4 tells `_HASH_CHECK` when it is asked for it alone, and first when all are asked for; whoever knows the hash need not
fetch 900 values. Missing ones are asked for by index.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from gcs.dialect import Message, mavlink
from gcs.errors import ParameterError
from gcs.microservices import Backoff, Microservice
from gcs.microservices.parameter_client import Value, decode

HASH_CHECK = "_HASH_CHECK"
QUIET_S = 0.5
"""A stream of parameters that pauses so long has ended."""
AT_ONCE = 20
"""Missing parameters that are asked for together."""
HASH_TRIES, ROUNDS = 3, 40
MOST_PARAMETERS = 4096


@dataclass(frozen=True)
class Parameter:
    """One value and the MAV_PARAM_TYPE in which it travels."""

    value: Value
    kind: int


@dataclass(frozen=True)
class ParameterSet:
    """All parameters of a vehicle at one moment."""

    values: Mapping[str, Parameter]
    hash_check: int | None = None
    """The vehicle's own digest of them; None if it has none."""


@dataclass
class ParameterFetch(Microservice):
    """Fetch all parameters; they end up in `result`.

    Args:
        peer: system and component.
        kept: what this vehicle had the last time.

    Raises:
        ParameterError: no answer, or some are missing after many requests.
    """

    peer: tuple[int, int]
    kept: ParameterSet | None = None
    result: ParameterSet | None = None
    done: bool = False
    deadline_s: float = math.inf
    wants: frozenset[str] = frozenset({"PARAM_VALUE"})
    turn: str | None = "parameters"
    _found: dict[int, tuple[str, Parameter]] = field(default_factory=dict[int, tuple[str, Parameter]])
    _count: int | None = None
    _hash: int | None = None
    _rounds: Backoff = field(default_factory=lambda: Backoff(QUIET_S, ROUNDS))

    def start(self, now_s: float) -> list[Message]:
        """With a kept copy the hash alone is asked for first."""
        self.deadline_s = now_s + self._rounds.take()
        if self._asks_hash:
            return [mavlink.MAVLink_param_request_read_message(*self.peer, HASH_CHECK.encode(), -1)]
        return [mavlink.MAVLink_param_request_list_message(*self.peer)]

    def receive(self, message: Message, now_s: float) -> list[Message]:
        if self.done:
            return []
        if message.param_id == HASH_CHECK:
            return self._take_hash(message, now_s)
        if not 0 < message.param_count <= MOST_PARAMETERS or message.param_index >= message.param_count:
            return []  # an echo of a PARAM_SET has no index
        if self._count != message.param_count:
            self._count = message.param_count
            self._found.clear()
        parameter = Parameter(decode(message), message.param_type)
        if isinstance(parameter.value, float) and not math.isfinite(parameter.value):
            return []
        self._found[message.param_index] = (message.param_id, parameter)
        self.deadline_s = now_s + QUIET_S
        if len(self._found) == self._count:
            self._end(dict(self._found.values()))
        return []

    def handle_timeout(self, now_s: float) -> list[Message]:
        if self._rounds.exhausted:
            self.done = True
            raise ParameterError(f"vehicle {self.peer[0]}: {len(self._found)} of {self._count or '?'} parameters came")
        if self._count is None or not self._found:
            return self.start(now_s)
        self.deadline_s = now_s + self._rounds.take()
        missing = [index for index in range(self._count) if index not in self._found][:AT_ONCE]
        return [mavlink.MAVLink_param_request_read_message(*self.peer, b"", index) for index in missing]

    @property
    def _asks_hash(self) -> bool:
        has_kept = self.kept is not None and self.kept.hash_check is not None
        return has_kept and self._hash is None and self._rounds.taken <= HASH_TRIES

    def _take_hash(self, message: Message, now_s: float) -> list[Message]:
        asked, self._hash = self._asks_hash, int(decode(message, mavlink.MAV_PARAM_TYPE_UINT32))
        if self.kept is not None and self.kept.hash_check == self._hash:
            self._end(dict(self.kept.values))
            return []
        return self.start(now_s) if asked else []

    def _end(self, values: dict[str, Parameter]) -> None:
        self.result, self.done = ParameterSet(dict(sorted(values.items())), self._hash), True
