"""What autopilots say, as lines."""

from gcs.dialect import mavlink
from gcs.fleet.status_texts import MOST_PER_WINDOW, StatusTexts
from tests.unit.gcs.messages import from_autopilot

LONG = "x" * 50 + "y" * 50 + "the end"


def said(text: str, number: int = 0, seq: int = 0, severity: int = 4):
    return from_autopilot(mavlink.MAVLink_statustext_message(severity, text.encode(), number, seq))


def chunks(number: int = 7) -> list:
    return [said(LONG[50 * seq : 50 * seq + 50], number, seq) for seq in range(3)]


def lines(texts: StatusTexts, messages: list, now_s: float = 0.0) -> list[str]:
    return [line.text for message in messages for line in texts.receive(message, now_s)]


def test_chunks_become_one_line_in_any_order():
    first, second, third = chunks()
    assert lines(StatusTexts(), [first, second, third]) == [LONG]
    assert lines(StatusTexts(), [third, first, second]) == [LONG]


def test_a_missing_chunk_is_shown_as_missing_after_a_while():
    texts, (first, second, third) = StatusTexts(), chunks()
    assert lines(texts, [first, third]) == []
    assert [line.text for line in texts.overdue(2.0)] == ["x" * 50 + "[…]" + "the end"]
    assert lines(texts, [first, second], 3.0) == []
    assert [line.text for line in texts.overdue(5.0)] == ["x" * 50 + "y" * 50 + "[…]"]


def test_a_repetition_is_left_out_for_a_while_and_another_severity_is_not_one():
    texts = StatusTexts()
    assert lines(texts, [said("Low battery"), said("Low battery")]) == ["Low battery"]
    assert lines(texts, [said("Low battery", severity=2)], 1.0) == ["Low battery"]
    assert texts.repeated == 1
    assert lines(texts, [said("Low battery")], 20.0) == ["Low battery"]


def test_a_flood_is_held_back_and_counted():
    texts = StatusTexts()
    shown = lines(texts, [said(f"text {number}") for number in range(1000)])
    assert len(shown) == MOST_PER_WINDOW
    assert texts.held_back == 1000 - MOST_PER_WINDOW
    assert lines(texts, [said("Motor failure", severity=1)]) == ["Motor failure"]  # not held up by the chatter
    assert lines(texts, [said("after")], 3.0) == ["after"]


def test_what_would_steer_a_terminal_or_turn_the_writing_around_is_replaced():
    nasty = ["\x1b[2J\x1b[31mred", "end\r\nfake line", "bell\x07", "c1\x9b31m", "\u202eabc"]
    shown = lines(StatusTexts(), [said(text) for text in nasty])
    assert shown == ["�[2J�[31mred", "end��fake line", "bell�", "c1��31m", "���abc"]


def test_many_missing_chunks_are_one_gap():
    texts = StatusTexts()
    assert lines(texts, [said("x" * 50, 7, 15)]) == []
    assert [line.text for line in texts.overdue(2.0)] == ["[…]" + "x" * 50 + "[…]"]


def test_chunks_of_ever_new_texts_are_not_kept_for_ever():
    texts = StatusTexts()
    for number in range(1, 500):
        texts.receive(said("z" * 50, number), 0.0)
    assert len(texts._chunks) <= 16
