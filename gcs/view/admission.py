"""Who is let in to the page: a token to be known, sessions for those who knew it, and little patience with guessing.

Pure: the time is an argument. Both tables are bounded, whatever comes in from outside.
"""

import hmac
import secrets
from collections import OrderedDict
from dataclasses import dataclass, field

SESSION_S = 12 * 3600.0
MOST_SESSIONS = 64
ATTEMPTS, ATTEMPTS_WINDOW_S = 5, 60.0
"""Wrong tokens that one address may offer within the window."""
ATTEMPTS_OF_ALL = 60
"""And all addresses together."""
MOST_ADDRESSES = 1000


class TooManyAttempts(Exception):
    """So many wrong tokens that no further one is looked at for a while."""


@dataclass
class Admission:
    """The door.

    Args:
        token: what has to be known.
    """

    token: str
    _sessions: OrderedDict[str, float] = field(default_factory=OrderedDict[str, float])
    """Session -> when it ends [s]."""
    _wrong: OrderedDict[str, list[float]] = field(default_factory=OrderedDict[str, list[float]])
    """Address -> times of its wrong tokens [s]."""

    def enter(self, address: str, offered: str, now_s: float) -> str | None:
        """A new session for who offers the right token, None for a wrong one; comparing takes constant time.

        Raises:
            TooManyAttempts: this address, or all together, have been wrong too often; nothing was compared.
        """
        self._forget(now_s)
        of_all = sum(len(times) for times in self._wrong.values())
        if len(self._wrong.get(address, ())) >= ATTEMPTS or of_all >= ATTEMPTS_OF_ALL:
            raise TooManyAttempts
        if not hmac.compare_digest(offered.encode(), self.token.encode()):
            self._wrong.setdefault(address, []).append(now_s)
            return None
        self._wrong.pop(address, None)
        session = secrets.token_urlsafe(32)
        self._sessions[session] = now_s + SESSION_S
        while len(self._sessions) > MOST_SESSIONS:
            self._sessions.popitem(last=False)
        return session

    def admits(self, session: str | None, now_s: float) -> bool:
        """Whether this is a session that has not ended."""
        if session is None:
            return False
        return any(
            hmac.compare_digest(session.encode(), own.encode())
            for own, end_s in self._sessions.items()
            if now_s < end_s
        )

    def _forget(self, now_s: float) -> None:
        for address, times in list(self._wrong.items()):
            self._wrong[address] = [time_s for time_s in times if now_s - time_s < ATTEMPTS_WINDOW_S]
            if not self._wrong[address]:
                del self._wrong[address]
        while len(self._wrong) > MOST_ADDRESSES:
            self._wrong.popitem(last=False)
        for session in [own for own, end_s in self._sessions.items() if now_s >= end_s]:
            del self._sessions[session]
