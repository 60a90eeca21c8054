"""Generated missions: the same for the same seed, well formed, solvable as far as geometry goes, and not trivial."""

from pathlib import Path

import numpy as np
import pytest

from missions import obstacles
from missions.errors import MissionError
from missions.generators import HARD, Kind, canyon, fleet, floors, forest, generate, maze, terrain
from missions.generators.__main__ import main
from missions.mission import Mission, load_mission
from missions.mission_file import to_yaml

SEEDS = range(5)


def straight_clearances_m(mission: Mission) -> np.ndarray:
    """(vehicles,) least clearance on the straight line of vehicle i to target i."""
    solid, shares = obstacles.pack(mission.world), np.linspace(0.0, 1.0, 400)[:, None]
    starts_m = [mission.start_m(vehicle) for vehicle in mission.vehicles]
    ends_m = [np.array(target.position_m) for target in mission.targets]
    lines_m = [start + shares * (end - start) for start, end in zip(starts_m, ends_m, strict=True)]
    return np.array([obstacles.clearance(line_m, solid).min() for line_m in lines_m])


@pytest.mark.parametrize("kind", Kind)
def test_a_seed_is_one_mission_and_another_seed_another(kind: Kind):
    assert generate(kind, 3) == generate(kind, 3)
    assert len({generate(kind, seed).digest for seed in SEEDS}) == len(SEEDS)


def fingerprint(mission: Mission) -> float:
    """A number that depends on every obstacle, pad and target."""
    parts = [
        *obstacles.pack(mission.world),
        [v.pad_m for v in mission.vehicles],
        [t.position_m for t in mission.targets],
    ]
    return sum(float(np.sqrt(np.abs(np.array(part, dtype=float))).sum()) for part in parts)


@pytest.mark.parametrize(
    ("kind", "number"),
    [
        (Kind.TERRAIN, 814.0859),
        (Kind.FLEET, 6074.4975),
        (Kind.MAZE, 120.2129),
        (Kind.FOREST, 975.4638),
        (Kind.CANYON, 2938.6378),
        (Kind.FLOORS, 115.8245),
    ],
)
def test_the_worlds_that_benchmarks_are_reported_for_stay_what_they_are(kind: Kind, number: float):
    """A change here makes kept benchmark results and optima worthless: measure them anew in the same commit."""
    assert fingerprint(generate(kind, 0)) == pytest.approx(number, abs=1e-3)


@pytest.mark.parametrize("kind", Kind)
def test_a_generated_mission_is_written_and_read_back_as_it_is(kind: Kind, tmp_path: Path):
    mission = generate(kind, 1)
    path = tmp_path / "generated.yaml"
    path.write_text(to_yaml(mission))
    assert load_mission(path) == mission


@pytest.mark.parametrize("kind", HARD)
@pytest.mark.parametrize("seed", SEEDS)
def test_in_the_hard_worlds_straight_lines_hit_something(kind: Kind, seed: int):
    mission = generate(kind, seed)
    assert np.count_nonzero(straight_clearances_m(mission) < 0.0) >= len(mission.vehicles) / 2


@pytest.mark.parametrize("vehicles", [5, 10])
def test_terrains_have_room_for_the_limits_between_vehicles(vehicles: int):
    for seed in range(20):
        mission = terrain(seed, vehicles)
        places_m = np.array([target.position_m for target in mission.targets])
        apart_m = np.linalg.norm(places_m[:, None] - places_m, axis=-1)
        means_m = 0.5 * apart_m.sum(axis=1) / (vehicles - 1)
        low_m, high_m = mission.limits.mean_separation_m
        assert np.all((low_m < means_m) & (means_m < high_m))
        assert apart_m[~np.eye(vehicles, dtype=bool)].min() >= 2.0 * mission.limits.separation_m
        assert 3 <= len(mission.world.peaks) + len(mission.world.threats) <= 5


def test_launch_points_of_terrains_lie_on_level_ground():
    for seed in range(20):
        mission = terrain(seed, 10)
        assert obstacles.terrain_height(np.zeros((1, 3)), obstacles.pack(mission.world))[0] < 1e-9


def test_most_terrains_obstruct_some_straight_line():
    limit_m = load_mission("terrain-1-5uav").limits.clearance_m
    assert sum(straight_clearances_m(terrain(seed, 5)).min() < limit_m for seed in range(20)) >= 15


@pytest.mark.parametrize("vehicles", [50, 100, 200])
def test_fleets_start_from_a_grid_and_fly_to_targets_that_are_apart(vehicles: int):
    mission = fleet(0, vehicles)
    pads_m = np.array([vehicle.pad_m for vehicle in mission.vehicles])
    targets_m = np.array([target.position_m for target in mission.targets])
    others = ~np.eye(vehicles, dtype=bool)
    assert np.linalg.norm(pads_m[:, None] - pads_m, axis=-1)[others].min() == pytest.approx(30.0)
    assert np.linalg.norm(targets_m[:, None] - targets_m, axis=-1)[others].min() >= 25.0
    assert set(targets_m[:, 0]) == {2000.0}
    assert mission.limits.mean_separation_m[1] == 500.0


def test_every_wall_of_a_maze_has_one_gap_wide_enough_for_two_clearances():
    for seed in SEEDS:
        mission = maze(seed, 3)
        for south, north in zip(mission.world.boxes[::2], mission.world.boxes[1::2], strict=True):
            gap_m = (north.centre_m[1] - north.half_m[1]) - (south.centre_m[1] + south.half_m[1])
            assert 4.0 * mission.limits.clearance_m < gap_m < 4.0


def test_trunks_of_a_forest_stand_apart():
    centres_m = np.array([trunk.centre_m for trunk in forest(2, 4).world.cylinders])
    apart_m = np.linalg.norm(centres_m[:, None] - centres_m, axis=-1) + 10.0 * np.eye(len(centres_m))
    assert apart_m.min() >= 0.8
    assert 80 <= len(centres_m) <= 150


def test_peaks_of_a_canyon_are_higher_than_vehicles_may_fly():
    mission = canyon(4, 5)
    assert all(peak.top_m > mission.world.bounds.up_m[1] for peak in mission.world.peaks)


def test_slabs_leave_their_opening_free_and_nothing_else():
    mission = floors(1, 2)
    solid = obstacles.pack(mission.world)
    east_m, north_m = np.meshgrid(np.arange(0.05, 20.0, 0.1), np.arange(0.05, 12.0, 0.1), indexing="ij")
    for height_m in (3.0, 6.0):
        points_m = np.stack((east_m, north_m, np.full_like(east_m, height_m)), axis=-1).reshape(-1, 3)
        free_m2 = 0.01 * np.count_nonzero(obstacles.clearance(points_m, solid) > 0.0)
        assert 5.0 * 3.0 - 1.0 < free_m2 < 6.0 * 4.0 + 1.0


def test_more_vehicles_than_a_world_has_room_for_are_refused():
    with pytest.raises(MissionError, match="maze: expected 1 to 4 vehicles, found 9"):
        generate(Kind.MAZE, 0, 9)


def test_the_command_writes_a_mission_or_says_what_is_wrong(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    path = tmp_path / "maze.yaml"
    assert main(["maze", "--seed", "3", "--output", str(path)]) == 0
    assert load_mission(path) == generate(Kind.MAZE, 3)
    assert main(["maze", "--output", str(tmp_path / "missing" / "maze.yaml")]) == 2
    assert "missing" in capsys.readouterr().err
    assert main(["floors", "--vehicles", "0"]) == 2
    assert "expected 1 to 4 vehicles, found 0" in capsys.readouterr().err
