"""Mission files: what ships is right, and what is wrong is named with its line."""

from pathlib import Path

import numpy as np
import pytest

from missions import obstacles
from missions.errors import ConfigError
from missions.mission import SHIPPED, Mission, OnArrival, Site, load_mission, shipped_missions

INDOOR = (SHIPPED / "indoor.yaml").read_text()

NAMES_OF_THE_DESIGN = {
    "indoor",
    "indoor-unmapped",
    "indoor-link-loss",
    "fleet-10",
    *(f"terrain-{terrain}-{uavs}uav" for terrain in (1, 2, 3) for uavs in (5, 10)),
}


def test_the_missions_that_scripts_rely_on_are_shipped():
    assert set(shipped_missions()) >= NAMES_OF_THE_DESIGN


@pytest.mark.parametrize("name", shipped_missions())
def test_every_shipped_mission_loads_and_bears_its_file_name(name: str):
    assert load_mission(name).name == name


def test_indoor_is_the_flight_of_the_paper():
    mission = load_mission("indoor")
    assert mission.world.bounds.high_enu_m.tolist() == [20.0, 15.0, 4.0]
    assert mission.world.boxes[0].half_m == (0.75, 1.5, 2.0)
    assert mission.world.cylinders[0].centre_m == (13.0, 8.0)
    assert (mission.limits.cruise_speed_m_s, mission.limits.avoidance_speed_m_s) == (3.0, 1.0)
    assert mission.on_arrival is OnArrival.LAND
    pads = {vehicle.name: vehicle.pad_m for vehicle in mission.vehicles}
    targets = {target.name: target.position_m for target in mission.targets}
    assert mission.allocation is not None
    for vehicle, target in mission.allocation.items():
        crossing = (pads[vehicle][1] - 7.5) * (targets[target][1] - 7.5)
        assert crossing < 0, "each vehicle's target lies on the other side"


def test_terrain_1_is_table_1_of_the_paper():
    world = load_mission("terrain-1-5uav").world
    assert [(*peak.centre_m, peak.radius_m) for peak in world.peaks] == [(600, 500, 100), (500, 1500, 200)]
    assert [(*threat.centre_m, threat.radius_m) for threat in world.threats] == [(1000, 1000, 400)]


def test_an_unmapped_obstacle_is_hidden_from_planners_and_real_for_the_simulator():
    world = load_mission("indoor-unmapped").world
    inside_the_pillar = np.array([[10.5, 10.3, 1.5]])
    assert obstacles.clearance(inside_the_pillar, obstacles.pack(world))[0] < 0
    assert obstacles.clearance(inside_the_pillar, obstacles.pack(world.as_known()))[0] > 0.5


def test_outdoor_missions_leave_more_room_around_a_start():
    assert load_mission("terrain-1-5uav").site is Site.OUTDOOR
    assert Site.OUTDOOR.start_tolerance_m > Site.INDOOR.start_tolerance_m


def test_the_digest_names_a_mission_and_its_place():
    mission = load_mission("indoor")
    assert mission.digest == load_mission(SHIPPED / "indoor.yaml").digest
    assert mission.digest != load_mission("indoor-unmapped").digest
    assert mission.digest != mission.moved_to(mission.frame.geodetic(np.array([100.0, 0.0, 0.0]))).digest


BROKEN = [
    ("half_m", "halff_m", 11, "world.boxes[0]", "unknown field `halff_m`"),
    ("0.75", "-0.75", 11, "world.boxes[0].half_m[0]", "> 0.0, got -0.75"),
    ("radius_m: 1.0, ", "", 13, "world.cylinders[0]", "missing required field `radius_m`"),
    ("site: indoor", "site: submarine", 4, "site", "'submarine'"),
    ("top_m: 3.0", "top_m: .nan", 13, "world.cylinders[0].top_m", "expected a finite number"),
    ("top_m: 3.0", "top_m: 1e999", 13, "world.cylinders[0].top_m", "Expected `float`"),
    ("sysid: 2", "sysid: 1", 17, "vehicles[1].sysid", "used twice"),
    ("name: bravo", "name: alpha", 17, "vehicles[1].name", "used twice"),
    ("[19, 8.5, 1.5]", "[19, 8.5]", 20, "targets[0].position_m", "length 3, got 2"),
    ("[19, 8.5, 1.5]", "[19, 88.5, 1.5]", 20, "targets[0].position_m", "outside of world.bounds"),
    ("[19, 8.5, 1.5]", "[13, 8.5, 1.5]", 20, "targets[0].position_m", "-0.50 m clearance"),
    ("[1, 8.5, 0]", "[1, 7.5, 0]", 17, "vehicles[1].pad_m", "1.00 m from the pad of alpha"),
    ("alpha: north-east", "alpha: west", 23, "allocation.alpha", "found 'west'"),
    ("bravo: south-east", "bravo: north-east", 23, "allocation", "given to two vehicles"),
    (", bravo: south-east", "", 23, "allocation", "bravo is missing"),
    ("clearance_m: 0.6", "clearance_m: 0.6\n  clearance_m: 0.7", 35, "limits", "stands here twice"),
    ("cruise_speed_m_s: 3.0", "cruise_speed_m_s: 0.5", 27, "limits", "avoidance_speed_m_s"),
    ("east_m: [0, 20]", "east_m: [20, 0]", 9, "world.bounds", "low < high"),
    ("latitude_deg: 47.3977432", "latitude_deg: 95", 5, "origin.latitude_deg", "<= 85.0, got 95"),
    ("on_arrival: land\n", "", 2, "", "missing required field `on_arrival`"),
    ("allocation: {", "allocation: [", 23, "", "not valid YAML"),
]


@pytest.mark.parametrize(("good", "bad", "line", "key", "problem"), BROKEN)
def test_a_broken_mission_is_refused_with_file_line_key_and_problem(
    tmp_path: Path, good: str, bad: str, line: int, key: str, problem: str
):
    assert good in INDOOR
    path = tmp_path / "broken.yaml"
    path.write_text(INDOOR.replace(good, bad, 1))
    with pytest.raises(ConfigError) as caught:
        load_mission(path)
    assert (caught.value.line, caught.value.key) == (line, key)
    assert str(caught.value).startswith(f"{path}:{line}: ")
    assert problem in str(caught.value)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "empty"),
        ("hello", "Expected `object`, got `str`"),
        ("[" * 2000 + "]" * 2000, "recursion"),
        ("a: &x [1]\nb: *x", "aliases"),
        ("a: \x00", "not valid YAML"),
        ("x" * 1_000_001, "at most 1000000 bytes"),
        ("!!python/object/apply:os.system ['true']", "not valid YAML"),
    ],
)
def test_files_that_are_no_missions_are_refused(tmp_path: Path, text: str, problem: str):
    path = tmp_path / "odd.yaml"
    path.write_text(text)
    with pytest.raises(ConfigError, match="odd.yaml") as caught:
        load_mission(path)
    assert problem in str(caught.value)


def test_an_unknown_name_lists_the_shipped_missions():
    with pytest.raises(ConfigError, match="shipped are: .*indoor"):
        load_mission("outdor")


def test_a_start_is_the_launch_point_or_above_the_pad():
    terrain: Mission = load_mission("terrain-1-5uav")
    indoor = load_mission("indoor")
    assert terrain.start_m(terrain.vehicles[3]).tolist() == [0.0, 0.0, 0.0]
    assert indoor.start_m(indoor.vehicles[0]).tolist() == [1.0, 6.5, 1.5]
