"""A mission is changed step by step, and stays a mission that can be flown."""

from pathlib import Path

import pytest

from missions.editing import Draft, Kind, Part, added, free_name, moved, parts, place_m, removed, resized, size_m
from missions.errors import MissionError
from missions.mission import Mission, load_mission, shipped_missions
from missions.mission_file import to_yaml
from missions.world import Box, Cylinder, Threat

TARGET, START, CRATE, COLUMN = (
    Part(Kind.TARGET, "north-east"),
    Part(Kind.START, "alpha"),
    Part(Kind.BOX, "crate"),
    Part(Kind.CYLINDER, "column"),
)


@pytest.fixture
def draft() -> Draft:
    return Draft(load_mission("indoor"))


def reloaded(mission: Mission, folder: Path) -> Mission:
    path = folder / "edited.yaml"
    path.write_text(to_yaml(mission))
    return load_mission(path)


@pytest.mark.parametrize("part", [TARGET, START, CRATE, COLUMN])
def test_a_part_is_moved_and_nothing_else(draft: Draft, part: Part, tmp_path: Path):
    before = draft.mission
    east, north, up = place_m(before, part)
    draft.apply(moved(part, (east + 0.4, north - 0.3, up)))
    assert place_m(draft.mission, part) == pytest.approx((east + 0.4, north - 0.3, up))
    assert size_m(draft.mission, part) == size_m(before, part)
    for other in parts(before):
        assert other == part or place_m(draft.mission, other) == place_m(before, other)
    assert reloaded(draft.mission, tmp_path) == draft.mission
    draft.apply(moved(part, (east, north, up)))
    assert draft.mission == before


@pytest.mark.parametrize("name", shipped_missions())
def test_every_mission_keeps_everything_when_it_is_saved(name: str, tmp_path: Path):
    mission = load_mission(name)
    assert reloaded(mission, tmp_path) == mission
    assert reloaded(mission, tmp_path).digest == mission.digest


@pytest.mark.parametrize(
    "thing",
    [
        Box(name="shelf", centre_m=(10.0, 12.0, 1.0), half_m=(0.5, 0.5, 1.0)),
        Cylinder(name="post", centre_m=(10.0, 12.0), radius_m=0.4, top_m=3.0),
        Threat(name="no-fly area 1", centre_m=(10.0, 12.0), radius_m=1.5),
    ],
)
def test_a_body_is_added_resized_and_removed(draft: Draft, thing: Box | Cylinder | Threat, tmp_path: Path):
    before = draft.mission
    draft.apply(added(thing))
    part = next(part for part in parts(draft.mission) if part.name == thing.name)
    draft.apply(resized(part, (1.2, 0.8, 1.5)))
    assert size_m(draft.mission, part)[0] == pytest.approx(1.2)
    assert place_m(draft.mission, part)[:2] == (10.0, 12.0)
    assert reloaded(draft.mission, tmp_path) == draft.mission
    draft.apply(removed(part))
    assert draft.mission == before


def test_what_would_not_load_is_refused_and_changes_nothing(draft: Draft):
    before = draft.mission
    for change, word in (
        (moved(TARGET, (7.0, 7.0, 1.0)), "clearance"),  # into the crate
        (moved(TARGET, (30.0, 7.0, 1.0)), "outside"),
        (moved(START, (1.0, 8.0, 0.0)), "pad of"),
        (removed(TARGET), "only obstacles"),
        (resized(TARGET, (1.0, 1.0, 1.0)), "no size"),
        (moved(Part(Kind.BOX, "nothing"), (1.0, 1.0, 1.0)), "has no box nothing"),
    ):
        with pytest.raises(MissionError, match=word):
            draft.apply(change)
    assert draft.mission is before
    assert not draft.can_undo


def test_changes_are_undone_and_done_again_until_a_new_one_is_made(draft: Draft):
    states = [draft.mission]
    for step in range(3):
        draft.apply(moved(TARGET, (18.0 - step, 8.5, 1.5)))
        states.append(draft.mission)
    draft.undo()
    draft.undo()
    assert draft.mission == states[1]
    draft.redo()
    assert draft.mission == states[2]
    draft.apply(moved(TARGET, (15.0, 10.0, 1.5)))
    assert not draft.can_redo
    for _ in range(9):
        draft.undo()
    assert draft.mission == states[0]


def test_a_change_that_changes_nothing_is_no_step(draft: Draft):
    draft.apply(moved(TARGET, place_m(draft.mission, TARGET)))
    assert not draft.can_undo


def test_names_of_new_bodies_are_free(draft: Draft):
    assert free_name(draft.mission.world, "box") == "box 1"
    draft.apply(added(Cylinder(name="box 1", centre_m=(10.0, 12.0), radius_m=0.4, top_m=3.0)))
    assert free_name(draft.mission.world, "box") == "box 2"
