"""What keeps each vehicle from being armed, as HTML; pure."""

from collections.abc import Iterator
from html import escape

from gcs.desk import Desk
from gcs.flight import preflight
from gcs.flight.monitor import Phase
from gcs.view.colours import Tone
from missions.mission import Vehicle


def render(desk: Desk, now_s: float) -> str:
    """One line per vehicle of the mission that is not in flight."""
    mission = desk.mission
    if mission is None:
        return '<ul class="gcs-ready"><li><span>no mission is loaded</span></li></ul>'
    lines = "".join(_line(vehicle.name, *_verdict(desk, vehicle, now_s)) for vehicle in mission.vehicles)
    return f'<ul class="gcs-ready">{lines}</ul>'


def _verdict(desk: Desk, vehicle: Vehicle, now_s: float) -> tuple[str, Tone]:
    part = desk.part(vehicle.sysid)
    if part is not None and part.monitor.phase.in_flight:
        return "in flight", Tone.GOOD
    if part is not None and part.monitor.phase is Phase.DONE:
        return part.monitor.reason or "flown", Tone.GOOD if part.monitor.reached else Tone.WARN
    problems = list(_problems(desk, vehicle, now_s))
    if problems:
        return "; ".join(problems), Tone.WARN
    prepared = part is not None and part.monitor.phase is Phase.PREPARED
    return ("ready, mission stored", Tone.GOOD) if prepared else ("fit to fly, nothing stored yet", Tone.INFO)


def _problems(desk: Desk, vehicle: Vehicle, now_s: float) -> Iterator[str]:
    assert desk.flight is not None
    state = desk.vehicles.get(vehicle.sysid)
    if state is None:
        yield "not heard"
        return
    yield from preflight.problems(state, vehicle, desk.flight.mission, now_s)
    if desk.flight.mode.needs_companions and not state.companion_online(now_s):
        yield "no companion heard"


def _line(name: str, verdict: str, tone: Tone) -> str:
    return f'<li><b>{escape(name)}</b><span class="{tone.value}">{escape(verdict)}</span></li>'
