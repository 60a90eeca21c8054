"""The pilot's states and where each may lead; docs/companion.md says what they mean."""

from missions.tunnel import CompanionState, Reason

State = CompanionState

TRANSITIONS: dict[State, frozenset[State]] = {
    State.CONNECTING: frozenset({State.WAITING, State.READY}),
    State.WAITING: frozenset({State.READY}),
    State.READY: frozenset({State.WAITING, State.ENGAGING}),
    State.ENGAGING: frozenset({State.FLYING, State.READY, State.RELEASED, State.HOLDING}),
    State.FLYING: frozenset({State.HOLDING, State.LANDING, State.RELEASED}),
    State.HOLDING: frozenset(
        {State.FLYING, State.LANDING, State.RELEASED, State.FINISHED, State.READY, State.ENGAGING}
    ),
    State.LANDING: frozenset({State.FINISHED, State.RELEASED}),
    State.FINISHED: frozenset({State.READY, State.WAITING, State.ENGAGING}),
    State.RELEASED: frozenset({State.READY, State.WAITING, State.ENGAGING}),
    State.FAILED: frozenset(),
}
"""Where a state may lead, besides CONNECTING (the autopilot is lost) and FAILED (an error of our own)."""

UNDER_WAY = frozenset({State.ENGAGING, State.FLYING, State.LANDING})
"""A MISSION_START in these has been obeyed already."""

RESTING = frozenset({State.CONNECTING, State.WAITING, State.READY, State.FINISHED, State.RELEASED})
"""Nothing is streamed in these, and nothing is about to be."""


def assert_possible(before: State, after: State, reason: Reason) -> None:
    """A transition that is not in the table is an error of ours.

    Raises:
        AssertionError: it is not.
    """
    if after is not before and after not in TRANSITIONS[before] | {State.CONNECTING, State.FAILED}:
        raise AssertionError(f"no transition from {before.name} to {after.name} ({reason.name})")
