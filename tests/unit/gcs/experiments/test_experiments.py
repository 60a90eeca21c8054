"""Every experiment fills its rows, and makes a summary and small pictures of them."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from gcs.experiments import ablation, ackley, allocation, convergence, paths, scaling, table2
from gcs.experiments.catalogue import EXPERIMENTS
from gcs.experiments.experiment import Experiment, Row, Run
from gcs.experiments.paper import printed
from gcs.experiments.series import from_cell, to_cell
from gcs.experiments.trials import Course
from gcs.planner.plan import Progress
from missions.generators import Kind, generate
from missions.mission import load_mission

FEW = {"absolute": 600, "offsets": 300}
MOST_BYTES = 150_000

SOME = {
    "ackley": {"size": "30 x 50"},
    "allocation": {"fleet": "fleet-5"},
    "paths": {"representation": "offsets"},
    "convergence": {"representation": "absolute"},
    "table2": {"mission": "terrain-1-5uav", "algorithm": "ecpso"},
    "ablation": {"mission": "terrain-2-5uav", "representation": "offsets"},
    "scaling": {"vehicles": 5},
}
"""The runs of each experiment that are tried here."""


@pytest.fixture(autouse=True)
def few_evaluations(monkeypatch: pytest.MonkeyPatch) -> None:
    for representation, evaluations in FEW.items():
        monkeypatch.setitem(table2.EVALUATIONS, representation, evaluations)
    monkeypatch.setattr(allocation, "EVALUATIONS", 100)


def some_runs(experiment: Experiment, seeds: Sequence[int]) -> list[Run]:
    wanted = SOME[experiment.name].items()
    return [run for run in experiment.runs(seeds) if all(run[column] == value for column, value in wanted)]


def done(experiment: Experiment, seeds: Sequence[int] = (0,)) -> list[Row]:
    return [{**dict(run.key), **experiment.work(run)} for run in some_runs(experiment, seeds)]


def test_the_papers_tables_and_figures_are_there():
    assert set(EXPERIMENTS) == set(SOME)
    assert EXPERIMENTS["table2"].default_runs == 30


@pytest.mark.parametrize("experiment", EXPERIMENTS.values(), ids=EXPERIMENTS.keys())
def test_runs_are_named_by_their_keys_and_seeds(experiment: Experiment):
    runs = experiment.runs([3, 4])
    assert all(tuple(column for column, _ in run.key) == experiment.key for run in runs)
    assert len({run.key for run in runs}) == len(runs)
    assert {run["seed"] for run in runs} == {3, 4}
    assert [run for run in runs if run["seed"] == 3] == experiment.runs([3])


@pytest.mark.parametrize("experiment", EXPERIMENTS.values(), ids=EXPERIMENTS.keys())
def test_rows_become_a_summary_and_small_pictures(experiment: Experiment, tmp_path: Path):
    rows = done(experiment)
    assert all(set(row) == set(experiment.columns) for row in rows)
    summary, pictures = experiment.summary(rows), experiment.figures(rows, tmp_path)
    assert "|---|" in summary
    assert "nan" not in summary
    for picture in pictures:
        assert f"({picture})" in summary
        assert 1_000 < (tmp_path / picture).stat().st_size < MOST_BYTES


@pytest.mark.parametrize("name", ["ackley", "convergence"])
def test_one_seed_makes_one_row(name: str):
    experiment = EXPERIMENTS[name]
    assert done(experiment, [7]) == done(experiment, [7])


def test_table_2_has_three_terrains_two_fleets_and_six_algorithms_twice():
    runs = [run for run in table2.runs([0]) if run["representation"] != table2.SHIPPED]
    assert len(runs) == 3 * 2 * 6 * 2
    assert len(table2.runs([0])) == len(runs) + 6


def test_the_papers_numbers_are_those_it_prints():
    cell = printed("terrain-1-5uav", "ecpso")
    assert cell is not None
    assert (cell.ibc, cell.fvc) == (56, 1834.4)
    assert printed("terrain-3-10uav", "pso") is None


def test_failed_runs_count_where_cpu_times_are_compared():
    world = {"representation": "offsets", "mission": "terrain-1-5uav", "algorithm": "ecpso"}
    reached = {**world, "seed": 0, "cpu_near_best_s": 0.5, "cpu_s": 2.0}
    failed = {**world, "seed": 1, "cpu_near_best_s": None, "cpu_s": 3.0}
    assert table2._expected_cpu([reached, failed]) == "3.50 (1/2)"
    assert table2._expected_cpu([failed]) == "never (0/1)"


def progress(evaluations: int, objective: float, feasible: bool) -> Progress:
    return Progress(evaluations // 100, evaluations, objective, feasible, 0.0)


def test_convergence_begins_where_the_best_comes_within_one_percent_of_the_last():
    course = Course()
    for step in ((100, 900.0, False), (200, 505.1, False), (300, 504.9, True), (400, 500.0, True)):
        course.note(progress(*step))
    assert course.converged_after() == 300
    first = course.first_feasible()
    assert first is not None
    assert first.evaluations == 300
    assert course.cpu_to(100.0) is None
    assert course.cpu_to(504.9) == course.steps[2][0]
    assert convergence.costs_at(course, np.array([50.0, 100.0, 250.0, 1000.0])) == [900.0, 900.0, 505.1, 500.0]


def test_the_ackley_function_is_the_known_one():
    assert ackley.ackley(np.zeros((1, 2)))[0] == pytest.approx(0.0, abs=1e-12)
    assert ackley.ackley(np.array([[1.0, 1.0]]))[0] == pytest.approx(3.6253849384403627)
    assert ackley.ackley(np.array([[0.5, -2.0]]))[0] > 5.0


def test_plans_are_kept_as_samples_of_their_curves():
    row = done(EXPERIMENTS["paths"], [0])[0]
    curves_m = paths.curves_of(row)
    assert curves_m.shape == (5, paths.DRAWN_SAMPLES, 3)
    np.testing.assert_allclose(curves_m[:, 0], 0.0)
    targets_m = [target.position_m for target in load_mission("terrain-1-5uav").targets]
    assert sorted(curves_m[:, -1].tolist()) == sorted([list(place) for place in targets_m])
    np.testing.assert_allclose(from_cell(to_cell([1.0, 2.5, -3.0])), [1.0, 2.5, -3.0])


def test_no_mechanism_left_is_plain_pso_and_all_of_them_are_ecpso(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(table2.EVALUATIONS, "offsets", 1200)
    rows = {row["variant"]: row for row in done(EXPERIMENTS["ablation"], [0])}
    assert set(rows) == set(ablation.VARIANTS)
    assert len({row["cost"] for row in rows.values()}) == len(rows)  # every switch does something


def test_allocation_rules_give_every_vehicle_a_target_of_its_own():
    mission = generate(Kind.FLEET, 1, 5)
    for rule in allocation.RULES.values():
        chosen = rule(mission)
        assert set(chosen) == {vehicle.name for vehicle in mission.vehicles}
        assert len(set(chosen.values())) == 5


def test_no_plan_can_be_better_than_the_least_objective():
    row = done(EXPERIMENTS["scaling"], [0])[0]
    assert row["feasible"] is True
    assert 1.0 <= float(str(row["over_bound"])) < 1.5
    mission = load_mission("terrain-1-5uav")
    assert scaling.least_objective(mission) == pytest.approx(2331.5 - 5 * 25.0, abs=0.1)
