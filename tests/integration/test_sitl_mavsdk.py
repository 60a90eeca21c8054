"""MAVSDK, an implementation of its own, takes the simulator for a PX4: the calls that companions are made of."""

import asyncio
import json
import math
from collections.abc import Iterator

import pytest
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.mavlink_direct import MavlinkDirectAsync
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.plugins.mavlink_direct import MavlinkMessage
from mavsdk.plugins.mission_raw import MissionItem
from mavsdk.plugins.offboard import AccelerationNed, PositionNedYaw, VelocityNedYaw
from mavsdk.plugins.telemetry import FlightMode, LandedState

from sitl.dialect import mavlink
from tests.integration.mavsdk_companion import companion, until
from tests.integration.sitl_process import GroundStation, free_instance_base, running_sitl

pytestmark = pytest.mark.processes

SPEED = 5.0
NAN = math.nan


@pytest.fixture(scope="module")
def base() -> Iterator[int]:
    """Four vehicles, one for each test, so that no test finds what another has left."""
    shift = free_instance_base()
    with running_sitl("--vehicles", "4", "--speed", f"{SPEED:g}", base=shift):
        yield shift


@pytest.fixture(scope="module")
def ground(base) -> Iterator[GroundStation]:
    station = GroundStation(base)
    yield station
    station.close()


async def test_telemetry_and_parameters(base):
    async with companion(base, 1) as (_, system):
        telemetry, parameters = TelemetryAsync(system), ParamAsync(system)
        await until(telemetry.health_all_ok)
        position = await telemetry.position()
        assert position.latitude_deg == pytest.approx(47.3977432, abs=1e-5)
        assert position.absolute_altitude_m == pytest.approx(489.4, abs=0.5)
        home = await until(telemetry.home)
        assert home.absolute_altitude_m == pytest.approx(489.4, abs=0.5)
        odometry = await telemetry.odometry()
        assert odometry.time_usec > 0
        assert abs(odometry.position_body.z_m) < 0.5
        assert (await telemetry.armed(), await telemetry.in_air()) == (False, False)
        assert await telemetry.landed_state() == LandedState.ON_GROUND
        assert await telemetry.flight_mode() == FlightMode.HOLD
        assert await until(telemetry.unix_epoch_time) > 1.7e15
        origin = await telemetry.get_gps_global_origin()
        assert origin.altitude_m == pytest.approx(489.4, abs=0.5)
        await parameters.set_param_float("MPC_XY_CRUISE", 3.5)
        assert await parameters.get_param_float("MPC_XY_CRUISE") == 3.5
        await parameters.set_param_int("COM_OBL_RC_ACT", 5)
        assert await parameters.get_param_int("COM_OBL_RC_ACT") == 5
        everything = await parameters.get_all_params()
        assert len(everything.float_params) > 70


async def test_a_flight_from_take_off_over_offboard_to_the_landing(base):
    async with companion(base, 2) as (_, system):
        telemetry, action, offboard = TelemetryAsync(system), ActionAsync(system), OffboardAsync(system)
        await until(telemetry.health_all_ok)
        await action.set_takeoff_altitude(3.0)
        await action.arm()
        await action.takeoff()
        await until(telemetry.in_air)
        await until(lambda: mode_is(telemetry, FlightMode.HOLD))

        def setpoint(north: float) -> tuple:
            position, still = PositionNedYaw(north, 0.0, -3.0, 0.0), VelocityNedYaw(0.0, 0.0, 0.0, 0.0)
            return position, still, AccelerationNed(0.0, 0.0, 0.0)

        await offboard.set_position_velocity_acceleration_ned(*setpoint(0.0))
        await offboard.start()
        await offboard.set_position_velocity_acceleration_ned(*setpoint(4.0))
        await until(lambda: is_north(telemetry, 3.8))
        await until(lambda: mode_is(telemetry, FlightMode.OFFBOARD))
        assert await offboard.is_active()
        await action.hold()
        await until(lambda: mode_is(telemetry, FlightMode.HOLD))
        here = await telemetry.position()
        await action.goto_location(here.latitude_deg + 3e-5, here.longitude_deg, here.absolute_altitude_m, NAN)
        await until(lambda: is_north(telemetry, 6.5))
        await action.return_to_launch()
        await until(lambda: mode_is(telemetry, FlightMode.RETURN_TO_LAUNCH))
        await action.land()
        await until(lambda: negated(telemetry.armed()))
        assert await telemetry.landed_state() == LandedState.ON_GROUND


async def mode_is(telemetry: TelemetryAsync, mode: FlightMode) -> bool:
    return await telemetry.flight_mode() == mode


async def is_north(telemetry: TelemetryAsync, north_m: float) -> bool:
    return (await telemetry.position_velocity_ned()).position.north_m > north_m


async def negated(answer) -> bool:
    return not await answer


def items(*norths_m: float) -> list[MissionItem]:
    """Waypoints 5 m up, north of the open field's origin."""
    x, y = 473977432, 85455942
    return [
        MissionItem(seq, 6, 16, int(seq == 0), 1, 0, 0, 0, NAN, x + round(north * 90), y, 5.0, 0)
        for seq, north in enumerate(norths_m)
    ]


def upload_from_the_ground(ground: GroundStation, sysid: int, mission: list[MissionItem]) -> None:
    """Another client's upload."""
    ground.forget()
    ground.send(mavlink.MAVLink_mission_count_message(sysid, 1, len(mission), 0), sysid)
    ground.until(lambda: ground.last("MISSION_REQUEST", sysid) or ground.last("MISSION_REQUEST_INT", sysid))
    for i in mission:
        message = mavlink.MAVLink_mission_item_int_message(
            sysid, 1, i.seq, i.frame, i.command, i.current, 1, 0, 0, 0, NAN, i.x, i.y, i.z, 0
        )
        ground.send(message, sysid)
    assert ground.until(lambda: ground.last("MISSION_ACK", sysid)).type == 0


async def test_missions_are_uploaded_flown_and_watched(base, ground):
    async with companion(base, 3) as (_, system):
        telemetry, mission = TelemetryAsync(system), MissionRawAsync(system)
        changes: list[bool] = []

        async def watch() -> None:
            async for changed in mission.subscribe_mission_changed():
                changes.append(changed)

        watching = asyncio.create_task(watch())
        try:
            await until(telemetry.health_all_ok)
            await mission.upload_mission(items(3.0, 6.0, 30.0))
            assert [item.x for item in await mission.download_mission()] == [item.x for item in items(3.0, 6.0, 30.0)]
            await asyncio.sleep(1.0)
            changes.clear()
            upload_from_the_ground(ground, 3, items(4.0, 8.0))
            await until(lambda: truth(changes))
            assert len(await mission.download_mission()) == 2
            await mission.set_current_mission_item(1)
            await ActionAsync(system).arm()
            await mission.start_mission()
            await until(lambda: mode_is(telemetry, FlightMode.MISSION))
            await until(lambda: finished(mission), 30.0)
            await mission.clear_mission()
            await until(lambda: mode_is(telemetry, FlightMode.HOLD))
        finally:
            watching.cancel()


async def truth(values: list[bool]) -> bool:
    return True in values


async def finished(mission: MissionRawAsync) -> bool:
    return (await mission.mission_progress()).current == 2


async def test_the_ground_reaches_the_companion_through_the_vehicle(base, ground):
    async with companion(base, 4) as (library, _):
        gcs_heartbeat = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
        ground.send(gcs_heartbeat, 4)

        async def system_of_the_ground():
            ground.send(gcs_heartbeat, 4)
            found = [s for s in await library.get_systems() if await s.get_system_id() == 255]
            return found[0] if found else None

        station = await until(system_of_the_ground)
        direct = MavlinkDirectAsync(station)
        commands: list[dict] = []

        async def watch() -> None:
            async for message in direct.subscribe_message("COMMAND_LONG"):
                commands.append(json.loads(message.fields_json))

        watching = asyncio.create_task(watch())
        try:
            await asyncio.sleep(0.3)
            ground.send(mavlink.MAVLink_command_long_message(4, 191, 300, 0, *[0] * 7), 4)
            await until(lambda: first_of(commands))
            assert commands[0]["command"] == 300
            ack = {"command": 300, "result": 0, "target_system": 255, "target_component": 190}
            await direct.send_message(MavlinkMessage("COMMAND_ACK", 4, 191, 255, 190, json.dumps(ack)))
            await until(lambda: heard(ground, "COMMAND_ACK", 191))
            payload = {"payload_type": 0x8051, "payload_length": 3, "payload": [1, 2, 3] + [0] * 125}
            tunnel = {"target_system": 0, "target_component": 0, **payload}
            await direct.send_message(MavlinkMessage("TUNNEL", 4, 191, 0, 0, json.dumps(tunnel)))
            await until(lambda: heard(ground, "TUNNEL", 191))
            assert list(ground.last("TUNNEL", 4).payload[:3]) == [1, 2, 3]
        finally:
            watching.cancel()


async def first_of(found: list):
    return found


async def heard(ground: GroundStation, kind: str, compid: int):
    return [m for m in ground.of(kind) if m.get_srcComponent() == compid]
