"""`gcs params` and `gcs links` on a simulated vehicle, as an operator uses them."""

import json
from pathlib import Path

import pytest

from tests.integration import programs
from tests.integration.sitl_process import free_instance_base, running_sitl


@pytest.mark.processes
def test_parameters_are_saved_compared_loaded_and_noted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    for folder in ("XDG_STATE_HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME"):
        monkeypatch.setenv(folder, str(tmp_path / folder))
    base, file = free_instance_base(), tmp_path / "vehicle.params"
    link = ("--link", f"udpin://127.0.0.1:{14550 + base}")

    def gcs(*arguments: str) -> programs.Finished:
        return programs.run("gcs", *arguments, *link)

    with running_sitl("--vehicles", "1", base=base):
        heard = gcs("links", "--seconds", "2")
        saved = gcs("params", "save", str(file))
        text = file.read_text()
        file.write_text(text.replace("COM_OBL_RC_ACT\t0\t6", "COM_OBL_RC_ACT\t5\t6"))
        differs = gcs("params", "diff", str(file), "--vehicle", "1")
        loaded = gcs("params", "load", str(file), "--vehicle", "1")
        same = gcs("params", "diff", str(file), "--vehicle", "1")
        refused = gcs("params", "set", "COM_OBL_RC_ACT", "0.5", "--vehicle", "1")
    assert [done.code for done in (heard, saved, differs, loaded, same, refused)] == [0, 0, 1, 0, 0, 1]
    assert f"1        UNSIGNED  udpin://127.0.0.1:{14550 + base}" in heard.output
    assert "COM_OBL_RC_ACT: 5 in the file, 0 on the vehicle" in differs.output
    assert "vehicle 1: COM_OBL_RC_ACT is 5" in loaded.output
    assert "expected an integer, found 0.5; nothing was set" in refused.output
    (orders,) = tmp_path.glob("XDG_STATE_HOME/*/orders.jsonl")
    entries = [json.loads(line) for line in orders.read_text().splitlines()]
    assert [(e["origin"], e["content"]) for e in entries if e["type"] == "order"] == [
        ("operator", {"name": "COM_OBL_RC_ACT", "value": 5})
    ]
    assert [entry["result"] for entry in entries if entry["type"] == "result"] == ["value 5"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (("params", "set", "A", "nan"), "expected a number, found 'nan'"),
        (("params", "diff", "/nowhere.params"), "/nowhere.params: cannot be read"),
    ],
)
def test_bad_input_ends_with_a_sentence_and_code_2(arguments: tuple[str, ...], says: str):
    finished = programs.run("gcs", *arguments)
    assert finished.code == 2
    assert says in finished.output
