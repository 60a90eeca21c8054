"""MAVSDK flies the simulator with every plugin that a multirotor's programs use; each test has a vehicle of its own."""

import asyncio
import json
import math
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager
from dataclasses import dataclass

import pytest
from mavsdk.asyncio.plugins.action import ActionAsync
from mavsdk.asyncio.plugins.calibration import CalibrationAsync
from mavsdk.asyncio.plugins.camera import CameraAsync
from mavsdk.asyncio.plugins.component_metadata import ComponentMetadataAsync
from mavsdk.asyncio.plugins.failure import FailureAsync
from mavsdk.asyncio.plugins.follow_me import FollowMeAsync
from mavsdk.asyncio.plugins.ftp import FtpAsync
from mavsdk.asyncio.plugins.geofence import GeofenceAsync
from mavsdk.asyncio.plugins.log_files import LogFilesAsync
from mavsdk.asyncio.plugins.manual_control import ManualControlAsync
from mavsdk.asyncio.plugins.mission import MissionAsync
from mavsdk.asyncio.plugins.mission_raw import MissionRawAsync
from mavsdk.asyncio.plugins.offboard import OffboardAsync
from mavsdk.asyncio.plugins.param import ParamAsync
from mavsdk.asyncio.plugins.telemetry import TelemetryAsync
from mavsdk.mavsdk import Configuration, Mavsdk
from mavsdk.plugins import mission_raw
from mavsdk.plugins.action import Action, ActionError, RelayCommand
from mavsdk.plugins.calibration import CalibrationError
from mavsdk.plugins.camera import CameraError
from mavsdk.plugins.component_metadata import ComponentMetadataError, MetadataType
from mavsdk.plugins.failure import FailureError, FailureType, FailureUnit
from mavsdk.plugins.follow_me import Config as FollowMeConfig
from mavsdk.plugins.follow_me import TargetLocation
from mavsdk.plugins.ftp import FtpError
from mavsdk.plugins.geofence import Circle, FenceType, GeofenceData, Point, Polygon
from mavsdk.plugins.log_files import LogFilesError
from mavsdk.plugins.mission import MissionItem, MissionPlan
from mavsdk.plugins.offboard import (
    AccelerationNed,
    Attitude,
    AttitudeRate,
    PositionGlobalYaw,
    PositionNedYaw,
    VelocityBodyYawspeed,
    VelocityNedYaw,
)
from mavsdk.plugins.param import ParamError
from mavsdk.plugins.telemetry import FlightMode, LandedState, Telemetry

from tests.integration.mavsdk_companion import companion, until
from tests.integration.sitl_process import free_instance_base, running_sitl

pytestmark = [pytest.mark.processes, pytest.mark.slow]

NAN = math.nan
LATITUDE, LONGITUDE = 47.3977432, 8.5455942


def _plan_item(command: int, frame: int, *params: float | None) -> dict:
    return {"type": "SimpleItem", "autoContinue": True, "command": command, "frame": frame, "params": list(params)}


PLAN_FILE = {
    "fileType": "Plan",
    "version": 1,
    "groundStation": "QGroundControl",
    "geoFence": {
        "version": 2,
        "polygons": [],
        "circles": [
            {"circle": {"center": [LATITUDE, LONGITUDE], "radius": 300}, "inclusion": True, "version": 1},
        ],
    },
    "mission": {
        "version": 2,
        "firmwareType": 12,
        "vehicleType": 2,
        "cruiseSpeed": 15,
        "hoverSpeed": 5,
        "plannedHomePosition": [LATITUDE, LONGITUDE, 489],
        "items": [
            _plan_item(22, 3, 0, 0, 0, None, LATITUDE, LONGITUDE, 5),
            _plan_item(178, 2, 1, 6, -1, 0, 0, 0, 0),
            _plan_item(16, 3, 0, 0, 0, None, LATITUDE + 5e-5, LONGITUDE, 5),
            _plan_item(205, 2, 0, 0, 0, 0, 0, 0, 2),
            _plan_item(2000, 2, 0, 0, 1, 0, 0, 0, 0),
            _plan_item(19, 3, 1, 1, 0, None, LATITUDE + 5e-5, LONGITUDE + 5e-5, 5),
            _plan_item(20, 2, 0, 0, 0, 0, 0, 0, 0),
        ],
    },
    "rallyPoints": {"version": 2, "points": [[LATITUDE + 5e-5, LONGITUDE, 10]]},
}
"""A plan as QGroundControl saves it."""
FENCE_ITEM = mission_raw.MissionItem(0, 5, 5003, 1, 1, 30.0, 0, 0, 0, 473977432, 85455942, 0.0, 1)
RALLY_ITEM = mission_raw.MissionItem(0, 6, 5100, 1, 1, 0, 0, 0, 0, 473978332, 85455942, 10.0, 2)


@pytest.fixture(scope="module")
def base() -> Iterator[int]:
    shift = free_instance_base()
    with running_sitl("--vehicles", "12", "--speed", "5", base=shift):
        yield shift


@dataclass(frozen=True)
class Flier:
    """The plugins on one vehicle."""

    telemetry: TelemetryAsync
    action: ActionAsync
    offboard: OffboardAsync
    parameters: ParamAsync
    system: object

    async def take_off(self) -> None:
        """To 5 m, and wait for Hold."""
        await self.action.set_takeoff_altitude(5.0)
        await self.action.arm()
        await self.action.takeoff()
        await self.in_mode(FlightMode.TAKEOFF)
        await self.in_mode(FlightMode.HOLD)

    async def in_mode(self, mode: FlightMode) -> None:
        async def holds() -> bool:
            return await self.telemetry.flight_mode() == mode

        await until(holds)

    async def position(self) -> tuple[float, float, float]:
        """North, east, down in the vehicle's own frame [m]."""
        found = (await self.telemetry.position_velocity_ned()).position
        return found.north_m, found.east_m, found.down_m

    async def velocity(self) -> tuple[float, float, float]:
        found = (await self.telemetry.position_velocity_ned()).velocity
        return found.north_m_s, found.east_m_s, found.down_m_s

    async def comes_to(
        self, measure: Callable[[], Awaitable[tuple[float, ...]]], wanted: tuple[float, ...], within: float
    ) -> None:
        """Wait until a measured vector is what is wanted."""

        async def holds() -> bool:
            return math.dist(await measure(), wanted) < within

        try:
            await until(holds)
        except TimeoutError:
            raise AssertionError(f"{measure.__name__} is {await measure()}, expected {wanted}") from None


@asynccontextmanager
async def flier(base: int, vehicle: int) -> AsyncIterator[Flier]:
    """A vehicle that is ready to be armed."""
    async with companion(base, vehicle) as (_, system):
        found = Flier(TelemetryAsync(system), ActionAsync(system), OffboardAsync(system), ParamAsync(system), system)
        await until(found.telemetry.health_all_ok)
        yield found


async def test_offboard_positions_and_velocities(base):
    async with flier(base, 1) as f:
        await f.take_off()
        offboard, (north, east, _) = f.offboard, await f.position()
        await offboard.set_position_ned(PositionNedYaw(north + 3.0, east, -5.0, 90.0))
        await offboard.start()
        await f.in_mode(FlightMode.OFFBOARD)
        await f.comes_to(f.position, (north + 3.0, east, -5.0), 0.5)
        await offboard.set_velocity_ned(VelocityNedYaw(0.0, 1.0, 0.0, 90.0))
        await f.comes_to(f.velocity, (0.0, 1.0, 0.0), 0.3)
        await offboard.set_velocity_body(VelocityBodyYawspeed(-1.0, 0.0, 0.0, 0.0))
        await f.comes_to(f.velocity, (0.0, -1.0, 0.0), 0.3)
        here = await f.position()
        there = PositionNedYaw(here[0], here[1], -6.0, 90.0)
        await offboard.set_position_velocity_ned(there, VelocityNedYaw(0.0, 0.0, 0.0, 90.0))
        await f.comes_to(f.position, (here[0], here[1], -6.0), 0.5)
        place = await f.telemetry.position()
        above = PositionGlobalYaw(
            place.latitude_deg, place.longitude_deg, 8.0, 90.0, PositionGlobalYaw.AltitudeType.REL_HOME
        )
        await offboard.set_position_global(above)
        await f.comes_to(f.position, (here[0], here[1], -8.0), 0.6)
        await offboard.stop()
        await f.in_mode(FlightMode.HOLD)


async def test_offboard_attitudes_rates_and_accelerations(base):
    async with flier(base, 2) as f:
        await f.take_off()

        async def pitch() -> tuple[float]:
            return ((await f.telemetry.attitude_euler()).pitch_deg,)

        async def yaw_rate() -> tuple[float]:
            return (math.degrees((await f.telemetry.attitude_angular_velocity_body()).yaw_rad_s),)

        await f.offboard.set_attitude(Attitude(0.0, -10.0, 0.0, 0.6))
        await f.offboard.start()
        await f.comes_to(pitch, (-10.0,), 2.0)
        await f.offboard.set_attitude_rate(AttitudeRate(0.0, 0.0, 30.0, 0.6))
        await f.comes_to(yaw_rate, (30.0,), 5.0)
        await f.offboard.set_velocity_ned(VelocityNedYaw(0.0, 0.0, 0.0, 0.0))
        await f.comes_to(f.velocity, (0.0, 0.0, 0.0), 0.4)
        await f.offboard.set_acceleration_ned(AccelerationNed(1.0, 0.0, 0.0))

        async def is_fast_northwards() -> bool:
            return (await f.velocity())[0] > 1.5

        await until(is_fast_northwards)
        await f.action.hold()
        await f.in_mode(FlightMode.HOLD)


def waypoint(latitude_deg: float) -> MissionItem:
    return MissionItem(
        latitude_deg, 8.5455942, 5.0, 3.0, True, NAN, NAN, MissionItem.CameraAction.NONE, NAN, NAN, 1.0, NAN, NAN,
        MissionItem.VehicleAction.NONE,
    )  # fmt: skip


async def test_missions_are_flown_paused_and_resumed(base):
    async with flier(base, 3) as f:
        mission = MissionAsync(f.system)
        await mission.upload_mission(MissionPlan([waypoint(47.3977932), waypoint(47.3979), waypoint(47.3977932)]))
        assert len((await mission.download_mission()).mission_items) == 3
        await f.action.arm()
        await mission.start_mission()

        async def is_under_way() -> bool:
            return (await mission.mission_progress()).current >= 1

        await until(is_under_way)
        await mission.pause_mission()
        await f.in_mode(FlightMode.HOLD)
        await mission.start_mission()
        await until(mission.is_mission_finished, 30.0)
        await f.action.return_to_launch()
        await f.in_mode(FlightMode.RETURN_TO_LAUNCH)
        await mission.clear_mission()


async def test_geofences_are_uploaded_and_kept(base):
    async with flier(base, 4) as f:
        fence, raw = GeofenceAsync(f.system), MissionRawAsync(f.system)
        home = await until(f.telemetry.home)
        south, west = home.latitude_deg - 1.3e-4, home.longitude_deg - 2e-4
        corners = [
            Point(south + north, west + east) for north, east in ((0, 0), (0, 4e-4), (2.6e-4, 4e-4), (2.6e-4, 0))
        ]
        circle = Circle(Point(home.latitude_deg, home.longitude_deg), 100.0, FenceType.INCLUSION)
        await fence.upload_geofence(GeofenceData([Polygon(corners, FenceType.INCLUSION)], [circle]))
        assert [item.command for item in await raw.download_geofence()] == [5001] * 4 + [5003]
        await f.take_off()
        await f.offboard.set_velocity_ned(VelocityNedYaw(5.0, 0.0, 0.0, 0.0))
        await f.offboard.start()
        await f.in_mode(FlightMode.OFFBOARD)
        await f.in_mode(FlightMode.HOLD)
        assert (await f.position())[0] > 10.0
        await fence.clear_geofence()
        assert await raw.download_geofence() == []


async def test_raw_fences_and_rally_points(base):
    async with flier(base, 5) as f:
        raw = MissionRawAsync(f.system)
        await raw.upload_geofence([FENCE_ITEM])
        await raw.upload_rally_points([RALLY_ITEM])
        (fence,), (rally,) = await raw.download_geofence(), await raw.download_rallypoints()
        assert (fence.command, fence.param1, fence.x) == (5003, 30.0, 473977432)
        assert (rally.command, rally.x, rally.z) == (5100, 473978332, 10.0)


async def test_sticks_fly_position_and_altitude_control(base):
    async with flier(base, 7) as f:
        sticks = ManualControlAsync(f.system)
        stick = [0.0, 0.0, 0.5, 0.0]

        async def hold_them() -> None:
            while True:
                await sticks.set_manual_control_input(*stick)
                await asyncio.sleep(0.02)

        await f.take_off()
        async with asyncio.TaskGroup() as group:
            hands = group.create_task(hold_them())
            await asyncio.sleep(0.3)
            await sticks.start_position_control()
            await f.in_mode(FlightMode.POSCTL)
            stick[0] = 0.5

            async def is_moving() -> bool:
                return math.hypot(*(await f.velocity())[:2]) > 1.0

            await until(is_moving)
            stick[0] = 0.0
            await sticks.start_altitude_control()
            await f.in_mode(FlightMode.ALTCTL)
            stick[2] = 1.0

            async def is_climbing() -> bool:
                return (await f.velocity())[2] < -1.0

            await until(is_climbing)
            hands.cancel()


async def test_orders_of_the_action_plugin_and_a_failsafe(base):
    async with flier(base, 6) as f:
        await f.action.set_return_to_launch_altitude(8.0)
        assert await f.action.get_return_to_launch_altitude() == 8.0
        assert await f.action.get_takeoff_altitude() == 2.5
        await f.take_off()
        await f.action.set_current_speed(3.0)
        place = await f.telemetry.position()
        await f.action.goto_location(
            place.latitude_deg + 9e-5, place.longitude_deg, place.absolute_altitude_m + 2.0, 0.0
        )
        north, east, down = await f.position()
        await f.comes_to(f.position, (north + 10.0, east, down - 2.0), 1.0)
        await f.parameters.set_param_int("COM_LOW_BAT_ACT", 3)
        await f.parameters.set_param_float("SIM_BAT_DRAIN", 15.0)
        await f.parameters.set_param_float("SIM_BAT_MIN_PCT", 1.0)
        await f.in_mode(FlightMode.LAND)
        await f.action.kill()

        async def is_disarmed() -> bool:
            return not await f.telemetry.armed()

        await until(is_disarmed)


async def test_somebody_is_followed(base):
    async with flier(base, 11) as f:
        follow_me = FollowMeAsync(f.system)
        await f.take_off()
        await follow_me.set_config(
            FollowMeConfig(8.0, 5.0, 0.1, FollowMeConfig.FollowAltitudeMode.CONSTANT, 5.0, 180.0)
        )
        assert (await follow_me.get_config()).follow_distance_m == 5.0
        place, (north, east, _) = await f.telemetry.position(), await f.position()
        latitude, longitude, altitude = place.latitude_deg + 1.8e-4, place.longitude_deg, place.absolute_altitude_m
        await follow_me.start()
        await f.in_mode(FlightMode.FOLLOW_ME)
        await follow_me.set_target_location(TargetLocation(latitude, longitude, altitude, 0.0, 0.0, 0.0))
        await f.comes_to(f.position, (north + 15.0, east, -8.0), 1.5)
        await follow_me.stop()
        await f.in_mode(FlightMode.HOLD)


async def test_a_plan_of_qgroundcontrol_is_imported_and_flown(base):
    """Take-off, speed, waypoint, camera and gimbal items, a wait, and a return to the nearest rally point."""
    async with flier(base, 12) as f:
        raw = MissionRawAsync(f.system)
        plan = await raw.import_qgroundcontrol_mission_from_string(json.dumps(PLAN_FILE))
        assert (len(plan.mission_items), len(plan.geofence_items), len(plan.rally_items)) == (7, 1, 1)
        await raw.upload_geofence(plan.geofence_items)
        await raw.upload_rally_points(plan.rally_items)
        await raw.upload_mission(plan.mission_items)
        await f.action.arm()
        await raw.start_mission()
        await f.in_mode(FlightMode.MISSION)
        await f.in_mode(FlightMode.RETURN_TO_LAUNCH)
        await f.action.kill()


async def test_what_is_not_there_is_refused_at_once(base):
    """Files, logs, calibration, relays and a transition are all answered in the time of one message."""
    async with companion(base, 8) as (_, system):
        action, telemetry = ActionAsync(system), TelemetryAsync(system)
        await until(telemetry.health_all_ok)
        began_s = time.monotonic()
        for asked, error, said in (
            (FtpAsync(system).list_directory("/"), FtpError, "UNSUPPORTED"),
            (LogFilesAsync(system).get_entries(), LogFilesError, "NO_LOGFILES"),
            (action.set_relay(0, RelayCommand.ON), ActionError, "UNSUPPORTED"),
            (action.transition_to_fixedwing(), ActionError, "NO_VTOL_TRANSITION_SUPPORT"),
            (action.terminate(), ActionError, "COMMAND_DENIED"),
            (action.shutdown(), ActionError, "UNSUPPORTED"),
            (CameraAsync(system).take_photo(1), CameraError, "ACTION_UNSUPPORTED"),
            (FailureAsync(system).inject(FailureUnit.SENSOR_GPS, FailureType.OFF, 0), FailureError, "DISABLED"),
            (ComponentMetadataAsync(system).get_metadata(1, MetadataType.PARAMETER), ComponentMetadataError, "NOT"),
            (ParamAsync(system).get_param_int("MPC_XY_CRUISE"), ParamError, "WRONG_TYPE"),
        ):
            with pytest.raises(error, match=said):
                await asked
        with pytest.raises(CalibrationError, match="UNSUPPORTED"):
            async for _ in CalibrationAsync(system).calibrate_gyro():
                pass
        assert time.monotonic() - began_s < 2.0


async def test_rates_can_be_set_for_all_that_a_px4_streams(base):
    async with companion(base, 9) as (_, system):
        telemetry = TelemetryAsync(system)
        await until(telemetry.health_all_ok)
        await telemetry.set_rate_distance_sensor(5.0)
        await telemetry.set_rate_scaled_imu(5.0)
        await telemetry.set_rate_actuator_output_status(5.0)
        await telemetry.set_rate_ground_truth(5.0)
        await telemetry.set_rate_rc_status(5.0)
        await telemetry.set_rate_battery(25.0)
        async with asyncio.timeout(10.0):
            assert (await anext(telemetry.subscribe_distance_sensor())).maximum_distance_m == 100.0
            assert (await anext(telemetry.subscribe_scaled_imu())).acceleration_frd.down_m_s2 == pytest.approx(
                -9.8, 0.1
            )
            assert (await anext(telemetry.subscribe_actuator_output_status())).active == 16
            assert (await anext(telemetry.subscribe_ground_truth())).absolute_altitude_m == pytest.approx(
                489.4, abs=0.1
            )
        batteries = telemetry.subscribe_battery()
        async with asyncio.timeout(10.0):
            for _ in range(20):
                assert (await anext(batteries)).voltage_v == pytest.approx(16.2, abs=0.1)


def test_the_synchronous_interface_takes_off_and_lands(base):
    library = Mavsdk(Configuration.create_manual(10, 191, True))
    try:
        library.add_any_connection(f"udpin://127.0.0.1:{14549 + base}")
        system = library.first_autopilot(10.0)
        action, telemetry = Action(system), Telemetry(system)
        landed_states = []
        telemetry.subscribe_landed_state(lambda state, _: landed_states.append(state))
        patiently(telemetry.health_all_ok)
        action.set_takeoff_altitude(3.0)
        assert action.get_takeoff_altitude() == 3.0
        action.arm()
        action.takeoff()
        patiently(lambda: telemetry.position().relative_altitude_m > 2.5)
        action.land()
        patiently(lambda: not telemetry.armed())
        assert {LandedState.TAKING_OFF, LandedState.LANDING, LandedState.ON_GROUND} <= set(landed_states)
    finally:
        library.destroy()


def patiently(holds: Callable[[], bool]) -> None:
    """Wait until something holds."""
    deadline_s = time.monotonic() + 20.0
    while not holds():
        assert time.monotonic() < deadline_s
        time.sleep(0.05)
