"""The command line: help, checks, plans, and bad input that ends with a sentence and code 2."""

import json
from pathlib import Path

import pytest

from missions.mission import SHIPPED, shipped_missions
from tests.integration import programs


@pytest.mark.parametrize(
    "program", [("gcs",), ("gcs", "fly"), ("gcs", "plan"), ("gcs", "watch"), ("sitl",), ("companion",)]
)
def test_help_says_what_a_program_does_and_gives_an_example(program: tuple[str, ...]):
    finished = programs.run(*program, "--help")
    assert finished.code == 0
    assert "Usage" in finished.output
    if program != ("gcs",):
        assert "xample" in finished.output


def test_checking_a_mission_says_what_is_in_it():
    finished = programs.run("gcs", "check", "indoor-unmapped")
    assert finished.code == 0
    assert "pillar (unmapped)" in finished.output
    assert "alpha (system 1)" in finished.output


def test_the_shipped_missions_are_listed():
    finished = programs.run("gcs", "missions")
    assert all(name in finished.output for name in shipped_missions())


def test_a_plan_is_written_as_scripts_expect_it(tmp_path: Path):
    output = tmp_path / "plan.json"
    finished = programs.run("gcs", "plan", "indoor", "--seed", "3", "--output", str(output))
    assert finished.code == 0, finished.output
    plan = json.loads(output.read_text())
    assert set(plan) >= {
        "mission", "algorithm", "seed", "evaluations", "wall_s", "cpu_s", "objective", "feasible", "violations",
        "convergence", "vehicles",
    }  # fmt: skip
    assert (plan["feasible"], plan["violations"], plan["seed"]) == (True, [], 3)
    for vehicle in plan["vehicles"]:
        assert set(vehicle) >= {"name", "target", "track_points_enu_m", "curve_enu_m", "length_m"}
        assert len(vehicle["curve_enu_m"][0]) == 3


def test_a_broken_mission_file_is_named_with_its_line(tmp_path: Path):
    broken = tmp_path / "broken.yaml"
    broken.write_text((SHIPPED / "indoor.yaml").read_text().replace("half_m", "halff_m"))
    for arguments in (("fly", "--sim", "--headless"), ("plan",), ("check",)):
        finished = programs.run("gcs", arguments[0], str(broken), *arguments[1:])
        assert finished.code == 2
        assert f"{broken}:11: world.boxes[0]: Object contains unknown field `halff_m`" in finished.output
        assert "Traceback" not in finished.output


@pytest.mark.processes
def test_a_fault_of_the_simulator_is_handed_to_it_and_its_complaint_is_handed_back():
    ports = ("--instance-base", str(programs.instance_base()))
    finished = programs.run("gcs", "fly", "indoor", "--sim", "--headless", "--fault", "reboot:vehicle=9", *ports)
    assert finished.code == 2
    assert "sitl: fault: vehicle: expected one of 1, 2, found 9" in finished.output


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("fly", "nowhere", "--sim"), "no such file, and no shipped mission of that name"),
        (("fly", "indoor", "--sim", "--companions"), "give one of --sim and --companions"),
        (("fly", "indoor", "--sim", "--fault", "flood"), "--fault flood"),
        (("fly", "indoor", "--companions", "--fault", "reboot:vehicle=1"), "reboot:vehicle=1: the simulator makes it"),
        (("fly", "indoor", "--sim", "--origin", "here,there"), "expected LAT,LON,ALT"),
        (("fly", "indoor", "--sim", "--origin", "91,0,0"), "expected LAT,LON,ALT"),
        (("fly", "indoor", "--sim", "--link", "carrier-pigeon"), "expected one of udpin://HOST:PORT"),
        (("fly", "indoor", "--sim", "--host", "0.0.0.0"), "loopback only"),
        (("fly", "indoor", "--sim", "--speed", "0"), "--speed"),
        (("fly", "indoor", "--sim", "--mode", "magic"), "--mode"),
        (("plan", "indoor", "--algorithm", "magic"), "ecpso"),
        (("plan", "indoor", "--output", "/nowhere/plan.json"), "cannot be written"),
        (("plan", "indoor", "--output", "plan.txt"), "ends in .json"),
        (("plan", "indoor", "--seed", "-1"), "--seed"),
    ],
)
def test_bad_input_ends_with_a_sentence_and_code_2(arguments: tuple[str, ...], says: str):
    finished = programs.run("gcs", *arguments)
    assert finished.code == 2, finished.output
    assert says in finished.output
    assert "Traceback" not in finished.output


def test_a_plan_goes_from_here_to_qgroundcontrol_and_onto_a_map(tmp_path: Path):
    planned = programs.run("gcs", "plan", "field", "--output", str(tmp_path / "x.plan"))
    assert planned.code == 0, planned.output
    mapped = programs.run("gcs", "convert", str(tmp_path / "x-alpha.plan"), str(tmp_path / "x.kml"))
    refused = programs.run("gcs", "convert", str(tmp_path / "x-alpha.plan"), str(tmp_path / "x.waypoints"))
    assert (mapped.code, refused.code) == (0, 2)
    assert "a mission alone, and there is more: 1 fence polygon" in refused.output
    assert "<LineString>" in (tmp_path / "x.kml").read_text()
