"""The operator's desk: everything that can be seen and done in a session, for the page and for headless runs alike.

    desk            the one door: intents in, state out
    intents         what can be asked for
    rules           whether it can be done now, and if not, why
    orderly         carries out what was asked of single vehicles
    orders          every order from pending to accepted, refused or failed
    seat            who is in command, and who looks on
    reposition      whether a vehicle can be sent to a place
    observations    what is watched over time: outlooks,
    histories       ... the course of heights, speeds, clearances and links,
    alerts          ... and what is wrong now

No viser, no socket.
"""

from gcs.desk.desk import Desk
from gcs.desk.intents import Details, Intent

__all__ = ["Desk", "Details", "Intent"]
