"""Who is in command."""

from gcs.desk.seat import CommandSeat


def seats() -> tuple[CommandSeat, list[str]]:
    said: list[str] = []
    return CommandSeat(said.append), said


def test_the_first_one_to_come_is_in_command_and_the_others_look_on():
    seat, said = seats()
    seat.arrive("a", "browser 1")
    seat.arrive("b", "browser 2")
    assert seat.why_not("a") is None
    assert seat.why_not("b") == "browser 1 is in command"
    assert said == []


def test_command_is_taken_over_and_everybody_is_told():
    seat, said = seats()
    seat.arrive("a", "browser 1")
    seat.arrive("b", "browser 2")
    seat.take("b")
    assert (seat.why_not("b"), seat.why_not("a")) == (None, "browser 2 is in command")
    assert said == ["browser 2 has taken command from browser 1"]


def test_a_reload_keeps_command_also_when_others_look_on():
    seat, said = seats()
    seat.arrive("a", "browser 1")
    seat.arrive("b", "browser 2")
    seat.leave("a")
    assert seat.why_not("b") == "nobody is in command: take it first"
    seat.arrive("c", "browser 3")
    assert seat.why_not("c") is None
    assert said == ["browser 1 has left: nobody is in command", "browser 3 is in command"]


def test_the_program_itself_may_always_command_and_strangers_never():
    seat, _ = seats()
    seat.arrive("a", "browser 1")
    assert seat.why_not(None) is None
    assert seat.why_not("nobody") is not None
    seat.take("nobody")
    assert seat.holder == "a"
