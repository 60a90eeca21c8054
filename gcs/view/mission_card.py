"""What is flown, how far it is, and why a button cannot be pressed, as HTML; pure."""

from collections.abc import Iterable, Sequence
from html import escape

from gcs.desk import Desk, Intent
from gcs.flight.monitor import Phase
from gcs.planner.plan import FleetPlan, Progress
from gcs.view.colours import Tone
from missions.mission import Mission

CHART_WIDTH, CHART_HEIGHT = 300, 44


def flight_phase(desk: Desk) -> tuple[str, Tone]:
    """Where the whole flight is, in one or two words."""
    if desk.flight is None:
        return "Watching", Tone.INFO
    if planning(desk):
        return "Planning", Tone.INFO
    parts = desk.flight.vehicles.values()
    phases = {part.monitor.phase for part in parts}
    if phases == {Phase.DONE}:
        reached = all(part.monitor.reached for part in parts)
        return ("Mission accomplished", Tone.GOOD) if reached else ("Ended", Tone.WARN)
    for phase, text, tone in (
        (Phase.INTERRUPTED, "Interrupted", Tone.WARN),
        (Phase.COMING_DOWN, "Coming down", Tone.WARN),
        (Phase.FLYING, "Flying", Tone.GOOD),
        (Phase.TAKING_OFF, "Taking off", Tone.GOOD),
        (Phase.HOVERING, "Hovering", Tone.GOOD),
    ):
        if phase in phases:
            return text, tone
    return _on_the_ground(desk)


def planning(desk: Desk) -> bool:
    """Whether the cloud planner is at work now."""
    if desk.flight is None or not desk.plan_progress:
        return False
    if desk.running in {Intent.PLAN, Intent.COMPARE}:
        return True
    return desk.running is Intent.FLY and desk.flight.plan is None


def render_head(desk: Desk, now_s: float) -> str:
    """Name and description of the mission, where the flight is, and when it begins by itself."""
    mission, (phase, tone) = desk.mission, flight_phase(desk)
    name, about = (mission.name, _about(mission)) if mission is not None else ("No mission", "Whatever is on the links")
    return (
        f'<section class="gcs-head"><h1>{escape(name)}</h1><p>{escape(about)}</p>'
        f'<span class="phase {tone.value}"><s></s>{escape(phase)}</span><small>{escape(_manner(desk))}</small>'
        f"{_countdown(desk, now_s)}</section>"
    )


def _countdown(desk: Desk, now_s: float) -> str:
    if desk.begins_s is None:
        return ""
    left_s = max(0, round(desk.begins_s - now_s))
    return f'<p class="countdown">The flight begins by itself in {left_s} s. Wait, or any order, keeps it.</p>'


def render_plan(plan: FleetPlan | None, progress: Sequence[Progress]) -> str:
    """The plan's figures, while it is being made and afterwards, with the course of its objective."""
    if plan is not None:
        best, verdict = plan.objective, "feasible" if plan.feasible else "not feasible"
        effort = f"{_thousands(plan.evaluations)} evaluations in {plan.wall_s:.2f} s"
        tone = Tone.GOOD if plan.feasible else Tone.BAD
    elif progress:
        last = progress[-1]
        best, verdict = last.objective, "feasible" if last.feasible else "not feasible yet"
        tone, effort = Tone.GOOD if last.feasible else Tone.WARN, f"{_thousands(last.evaluations)} evaluations"
    else:
        return '<section class="gcs-plan empty">No plan yet</section>'
    course = plan.convergence if plan is not None else progress
    return (
        f'<section class="gcs-plan"><span class="figure"><b>{best:.1f}</b><small>objective</small>'
        f'<i class="{tone.value}">{verdict}</i></span>'
        f"{chart([step.objective for step in course])}<p>{effort}</p></section>"
    )


def render_reasons(refused: Iterable[tuple[str, str]]) -> str:
    """Why buttons cannot be pressed: (button, reason), those with the same reason together."""
    by_reason: dict[str, list[str]] = {}
    for button, reason in refused:
        by_reason.setdefault(reason, []).append(button)
    lines = (f"<p><b>{escape(', '.join(buttons))}</b> {escape(why)}</p>" for why, buttons in by_reason.items())
    return f'<section class="gcs-reasons">{"".join(lines)}</section>'


def chart(values: Sequence[float]) -> str:
    """A small line of values over their index, as SVG; nothing for fewer than two."""
    if len(values) < 2:
        return ""
    low, high = min(values), max(values)
    across, up = CHART_WIDTH / (len(values) - 1), (CHART_HEIGHT - 4) / ((high - low) or 1.0)
    points = " ".join(
        f"{index * across:.1f},{CHART_HEIGHT - 2 - (value - low) * up:.1f}" for index, value in enumerate(values)
    )
    box = f"0 0 {CHART_WIDTH} {CHART_HEIGHT}"
    area = f"0,{CHART_HEIGHT} {points} {CHART_WIDTH},{CHART_HEIGHT}"
    return (
        f'<svg viewBox="{box}" preserveAspectRatio="none"><polygon points="{area}"/><polyline points="{points}"/></svg>'
    )


def _on_the_ground(desk: Desk) -> tuple[str, Tone]:
    assert desk.flight is not None
    if desk.running in {Intent.LOAD, Intent.MODE}:
        return "Loading", Tone.INFO
    if desk.flight.prepared:
        return "Ready to fly", Tone.INFO
    if desk.running is Intent.UPLOAD or (desk.running is Intent.FLY and desk.flight.plan is not None):
        return "Preparing", Tone.INFO
    if desk.running is Intent.FLY:
        return "Connecting", Tone.INFO
    return ("Planned", Tone.INFO) if desk.flight.plan is not None else ("Ready to plan", Tone.QUIET)


def _about(mission: Mission) -> str:
    return mission.description or f"{len(mission.vehicles)} vehicles, {len(mission.targets)} targets"


def _manner(desk: Desk) -> str:
    """Who plans, and how fast time runs where it is not as usual."""
    if desk.flight is None:
        return ""
    speed = desk.flight.speed
    return desk.flight.mode.value + (f" · {speed:g}× time" if speed != 1.0 else "")


def _thousands(number: int) -> str:
    return f"{number:,}".replace(",", "\u202f")
