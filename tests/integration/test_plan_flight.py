"""A plan that QGroundControl has saved is flown as it stands, and what was recorded is read by MAVProxy's library."""

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from pymavlink import mavutil

from missions.frames import GeodeticPoint, LocalFrame
from tests.integration import programs

HOME = [47.3977432, 8.5455942, 489.4]
CORNER, RALLY = [47.3979, 8.5459, 12], [47.3978, 8.5457, 15]
FENCE = [[47.3970, 8.5450], [47.3985, 8.5450], [47.3985, 8.5475], [47.3970, 8.5475]]


def item(number: int, command: int, place: list[float], frame: int = 3) -> dict:
    return {
        "AMSLAltAboveTerrain": None,
        "Altitude": place[2],
        "AltitudeMode": 1,
        "autoContinue": True,
        "command": command,
        "doJumpId": number,
        "frame": frame,
        "params": [0, 0, 0, None if frame == 3 else 0, *place],
        "type": "SimpleItem",
    }


PLAN = {
    "fileType": "Plan",
    "geoFence": {"circles": [], "polygons": [{"inclusion": True, "polygon": FENCE, "version": 1}], "version": 2},
    "groundStation": "QGroundControl",
    "mission": {
        "cruiseSpeed": 15,
        "firmwareType": 12,
        "globalPlanAltitudeMode": 1,
        "hoverSpeed": 5,
        "items": [
            item(1, 22, [*HOME[:2], 10]),
            item(2, 16, [47.3979, 8.5456, 12]),
            item(3, 16, CORNER),
            item(4, 20, [0, 0, 0], frame=2),
        ],
        "plannedHomePosition": HOME,
        "vehicleType": 2,
        "version": 2,
    },
    "rallyPoints": {"points": [RALLY], "version": 2},
    "version": 1,
}


@pytest.mark.processes
def test_a_plan_of_qgroundcontrol_is_flown_and_its_recording_read_by_other_tools(tmp_path: Path):
    plan, report = tmp_path / "square.plan", tmp_path / "report"
    plan.write_text(json.dumps(PLAN))
    ports = ("--instance-base", str(programs.instance_base()))
    done = programs.run("gcs", "fly", str(plan), "--sim", "--headless", "--speed", "5", "--report", str(report), *ports)
    assert done.code == 0, done.output
    assert "4 mission items and 4 fence items stored and read back" in done.output
    assert programs.report_of(report)["success"]
    flown_m = programs.truth_of(report)[1].in_flight().positions_m
    frame = LocalFrame(GeodeticPoint(latitude_deg=HOME[0], longitude_deg=HOME[1], altitude_amsl_m=HOME[2]))
    for latitude_deg, longitude_deg, height_m in (CORNER, RALLY):
        place_m = frame.enu(latitude_deg, longitude_deg, HOME[2] + height_m)
        assert np.linalg.norm(flown_m[:, :2] - place_m[:2], axis=1).min() < 2.5
    assert np.linalg.norm(flown_m[-1][:2] - place_m[:2]) < 1.0  # it returns to the rally point
    recording = mavutil.mavlink_connection(str(report / "flight.tlog"), dialect="development")
    kinds = Counter(message.get_type() for message in iter(recording.recv_match, None))
    recording.close()
    assert kinds["BAD_DATA"] == 0
    assert min(kinds["HEARTBEAT"], kinds["GLOBAL_POSITION_INT"], kinds["MISSION_ITEM_INT"], kinds["COMMAND_ACK"]) > 0
