"""Whatever happens, in whatever order: the pilot never acts without having been told to, and never raises."""

import numpy as np
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from companion import events, instructions
from companion.events import FlightMode
from companion.states import TRANSITIONS, State
from missions.mission_items import MissionItem
from tests.unit.companion.rig import GCS, HOME, LEVEL, Rig, items_of, moved, of, with_home

ACTING = (instructions.SendSetpoint, instructions.CommandMode)
MODES = st.sampled_from(list(FlightMode))
BAD_ITEMS = ((MissionItem(command=99),), (), items_of()[:1])

HAPPENINGS = st.one_of(
    st.sampled_from(
        [
            events.AutopilotFound(),
            events.AutopilotLost(),
            events.OriginReported(HOME),
            events.OriginReported(moved(HOME, 1e-5)),
            events.HomeReported(HOME),
            with_home(HOME.altitude_amsl_m + 0.5),
            events.UtcReported(1.7e9),
            events.MissionReported(7, 0),
            events.MissionReported(8, 3),
            events.MissionReported(0, 0),
            events.MissionDownloaded(7, items_of()),
            events.MissionDownloaded(8, None),
            *(events.MissionDownloaded(8, items) for items in BAD_ITEMS),
            events.Tick(0.0),
            events.Tick(5.0),
        ]
    ),
    st.builds(events.ArmingReported, st.booleans()),
    st.builds(events.LandedReported, st.booleans()),
    st.builds(events.ModeReported, MODES),
    st.builds(events.ModeCommandEnded, MODES, st.booleans()),
    st.sampled_from(["odometry", "odometry far away", "second", "answer"]),
)
STARTS = st.one_of(HAPPENINGS, st.just(events.StartCommanded(GCS)))
STOPS = st.one_of(STARTS, st.just(events.StopRequested()))
QUICK = settings(max_examples=60, suppress_health_check=[HealthCheck.too_slow])


class Story:
    """A rig to which anything happens; instructions and states are kept."""

    def __init__(self) -> None:
        self.rig = Rig(answers_plans=False)
        self.states = [self.rig.pilot.state]

    def go_on(self, happened: events.Event | str) -> list:
        rig = self.rig
        rig.now_s += 0.02
        match happened:
            case "odometry":
                out = rig.feed(rig.odometry())
            case "odometry far away":
                out = rig.feed(events.Odometry(rig.now_s, np.array([50.0, 9.0, -3.0]), np.zeros(3), LEVEL))
            case "second":
                out = rig.run(1.0)
            case "answer":
                wanted = of(rig.sent, instructions.RequestPlan)
                out = rig.feed(rig.answer(wanted[-1].request)) if wanted else []
            case _:
                out = rig.feed(happened)
        self.states.append(rig.pilot.state)
        return out


@QUICK
@given(st.lists(HAPPENINGS, max_size=60))
def test_without_a_start_nothing_is_ever_streamed_or_commanded(story: list):
    told = Story()
    told.rig.airborne()
    for happened in story:
        assert not any(isinstance(instruction, ACTING) for instruction in told.go_on(happened))
    assert not told.rig.pilot.in_control


@QUICK
@given(st.lists(STOPS, max_size=80))
def test_whatever_happens_it_never_raises_and_only_goes_where_the_table_lets_it(story: list):
    told = Story()
    told.rig.airborne()
    for happened in story:
        before = told.rig.pilot.state
        told.go_on(happened)
        after = told.rig.pilot.state
        one_step = after is before or after in TRANSITIONS[before] | {State.CONNECTING, State.WAITING, State.READY}
        assert one_step or happened == "second" or isinstance(happened, events.ModeReported | events.Odometry)


@QUICK
@given(st.lists(STARTS, max_size=60), st.sampled_from([FlightMode.HOLD, FlightMode.RTL, FlightMode.OTHER]))
def test_after_a_mode_that_was_not_asked_for_nothing_is_sent_until_the_next_start(story: list, mode: FlightMode):
    told = Story()
    told.rig.answers_plans = True
    told.rig.flying()
    for happened in story:
        told.go_on(happened)
    was_leaving = told.rig.pilot._leaving
    told.go_on(events.ModeReported(FlightMode.OFFBOARD))
    told.go_on(events.ModeReported(mode))
    if was_leaving is not None:
        return  # the flight was about to end in a mode of its own
    for quiet in (events.Tick(0.0), "odometry", "answer", events.Tick(0.0), "second"):
        assert not any(isinstance(instruction, ACTING) for instruction in told.go_on(quiet))


@QUICK
@given(st.lists(STARTS, max_size=60))
def test_the_stream_always_ends_when_control_does(story: list):
    """Between two setpoints without control there is an EndSetpoints."""
    told = Story()
    told.rig.airborne()
    streaming = False
    for happened in story:
        for instruction in told.go_on(happened):
            if isinstance(instruction, instructions.SendSetpoint):
                streaming = True
            if isinstance(instruction, instructions.EndSetpoints):
                streaming = False
        assert streaming == told.rig.pilot.in_control or not streaming
