"""What the page calls the states of vehicles and companions, and in which tone; pure."""

import math

from gcs.dialect import Mode
from gcs.fleet.vehicle_state import VehicleState
from gcs.flight.monitor import Phase
from gcs.security.signing import Trust
from gcs.view.colours import Tone
from missions.tunnel import CompanionState, Reason

NOTHING = "–"

_CALM_MODES = {Mode.OFFBOARD, Mode.MISSION, Mode.TAKEOFF}
_COMPANION_TONES = {
    CompanionState.READY: Tone.INFO,
    CompanionState.ENGAGING: Tone.GOOD,
    CompanionState.FLYING: Tone.GOOD,
    CompanionState.LANDING: Tone.GOOD,
    CompanionState.FINISHED: Tone.INFO,
    CompanionState.HOLDING: Tone.WARN,
    CompanionState.RELEASED: Tone.WARN,
    CompanionState.FAILED: Tone.BAD,
}
_TRUST_WORDS = {
    Trust.SIGNED: ("signed", Tone.GOOD),
    Trust.PENDING: ("key pending", Tone.WARN),
    Trust.UNSIGNED: ("no", Tone.WARN),
}
_PHASE_TONES = {
    Phase.WAITING: Tone.QUIET,
    Phase.PREPARED: Tone.INFO,
    Phase.INTERRUPTED: Tone.WARN,
    Phase.COMING_DOWN: Tone.WARN,
}


def number_words(value: float) -> str:
    """A number with one decimal below a hundred and none above, so that it does not change without meaning."""
    if not math.isfinite(value):
        return NOTHING
    text = f"{value:.1f}" if abs(value) < 99.95 else f"{value:.0f}"
    return "0.0" if text == "-0.0" else text


def mode_words(state: VehicleState, now_s: float) -> tuple[str, Tone]:
    """The vehicle's mode, or what matters more: that it is lost or in a failsafe."""
    if not state.online(now_s):
        return "Lost", Tone.BAD
    name = state.mode.name.replace("_", " ").capitalize() if len(state.mode.name) > 3 else state.mode.name
    if state.failsafe:
        return f"{name} (failsafe)", Tone.BAD
    if not state.armed:
        return name, Tone.QUIET
    return name, Tone.GOOD if state.mode in _CALM_MODES else Tone.WARN


def phase_words(phase: Phase | None, reached: bool) -> tuple[str, Tone]:
    """Where a vehicle is in its flight."""
    if phase is None:
        return NOTHING, Tone.QUIET
    if phase is Phase.DONE:
        return ("reached", Tone.GOOD) if reached else ("ended", Tone.WARN)
    return phase.value, _PHASE_TONES.get(phase, Tone.GOOD)


def companion_words(state: VehicleState, now_s: float) -> tuple[str, Tone]:
    """What the vehicle's companion is doing."""
    status = state.companion.status
    if math.isinf(state.companion.heard_s):
        return NOTHING, Tone.QUIET
    if not state.companion_online(now_s):
        return "silent", Tone.BAD
    if status is None:
        return "heard", Tone.QUIET
    tone = _COMPANION_TONES.get(status.state, Tone.QUIET)
    if (status.state, status.reason) == (CompanionState.HOLDING, Reason.TARGET_REACHED):
        tone = Tone.GOOD
    return status.state.name.lower(), tone


def battery_tone(percent: float) -> Tone:
    """How full a battery is."""
    if percent < 20.0:
        return Tone.BAD
    return Tone.WARN if percent < 40.0 else Tone.GOOD


def age_words(age_s: float) -> tuple[str, Tone]:
    """How long ago a vehicle was heard: in steps, so that a live link stands still."""
    if math.isinf(age_s):
        return NOTHING, Tone.QUIET
    if age_s < 1.0:
        return "live", Tone.GOOD
    return f"{age_s:.0f} s", Tone.WARN if age_s < 3.0 else Tone.BAD


def quality_words(quality: float) -> tuple[str, Tone]:
    """Share of a vehicle's messages that arrive, in steps of 5 %."""
    if math.isnan(quality):
        return NOTHING, Tone.QUIET
    tone = Tone.BAD if quality < 0.5 else Tone.WARN if quality < 0.8 else Tone.GOOD
    return f"{5 * round(20 * quality)} %", tone


def trust_words(trust: Trust) -> tuple[str, Tone]:
    """Whether a vehicle's frames are signed."""
    return _TRUST_WORDS[trust]


def duration_words(seconds: float) -> str:
    """Minutes and seconds."""
    if not math.isfinite(seconds):
        return NOTHING
    minutes, rest = divmod(round(max(seconds, 0.0)), 60)
    return f"{minutes}:{rest:02d}"
