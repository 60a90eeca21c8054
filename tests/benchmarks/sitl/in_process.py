"""One vehicle in process, without sockets: how fast it can be simulated, and when it may arm."""

import time
from collections.abc import Iterator

from sitl.dialect import Message, mavlink
from sitl.fleet import TICK_S
from sitl.microservices.outbox import Link
from sitl.simulator import Simulator

WINDOW_S = 20.0
"""Simulated time that is measured at once."""
WINDOWS = 5
LONGEST_BOOT_S = 5.0
NAN = float("nan")


def boot_s() -> float:
    """Simulated time until SYS_STATUS, asked for every tick, says that a vehicle may be armed; infinite if never."""
    simulator = Simulator(1, seed=1)
    _command(simulator, 511, 1.0, TICK_S * 1e6)
    parser = mavlink.MAVLink(None)
    while simulator.time_s < LONGEST_BOOT_S:
        simulator.step()
        for _, _, frame in simulator.transmissions():
            message = parser.decode(bytearray(frame))
            if message.get_type() == "SYS_STATUS" and _may_arm(message):
                return simulator.time_s
    return float("inf")


def _may_arm(sys_status: Message) -> bool:
    return bool(sys_status.onboard_control_sensors_health & mavlink.MAV_SYS_STATUS_PREARM_CHECK)


def speeds_in_flight() -> Iterator[float]:
    """Simulated seconds per CPU second of a hovering vehicle that sends its streams, window by window.

    Raises:
        RuntimeError: it has not taken off.
    """
    simulator = Simulator(1, seed=1)
    _advance(simulator, 2.0)
    _command(simulator, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1.0)
    _command(simulator, mavlink.MAV_CMD_NAV_TAKEOFF, NAN, 0.0, 0.0, NAN, NAN, NAN, NAN)
    _advance(simulator, 15.0)
    if (height_m := float(simulator.truth.position_enu_m[0, 2])) < 2.0:
        raise RuntimeError(f"the vehicle should hover above 2 m by now, and is at {height_m:.1f} m")
    for _ in range(WINDOWS):
        begun_s = time.process_time()
        _advance(simulator, WINDOW_S)
        yield WINDOW_S / (time.process_time() - begun_s)


def _advance(simulator: Simulator, duration_s: float) -> None:
    for _ in range(round(duration_s / TICK_S)):
        simulator.step()
        simulator.transmissions()


def _command(simulator: Simulator, number: int, *params: float) -> None:
    message = mavlink.MAVLink_command_long_message(1, 1, number, 0, *params, *(0.0,) * (7 - len(params)))
    simulator.receive(1, Link.GROUND, message.pack(mavlink.MAVLink(None, 255, 190)))
