"""UDP ports that two programs must agree on without a word; all of them before any shift by `--instance-base`."""

FIRST_COMPANION_PORT = 14540
FURTHER_COMPANIONS_PORT = 15050
"""Of vehicle 11: the ports of the first ten end before the ground station's, 14550."""
FIRST_ONBOARD_PORT = 14580
FURTHER_ONBOARD_PORT = 15300
"""Of vehicle 121: the ports of the first 120 end before those of the fleet link."""
FIRST_FLEET_PORT = 14700
FLEET_GROUP = "239.255.145.50"
"""The multicast group in which companions hear each other without a relay."""
RADIO_PORT = 14980
"""Where the simulator hears what companions say to each other."""


def companion_port(sysid: int) -> int:
    """Where a vehicle's companion listens to its autopilot.

    Example:
        >>> companion_port(1), companion_port(10), companion_port(11), companion_port(250)
        (14540, 14549, 15050, 15289)
    """
    return FIRST_COMPANION_PORT + sysid - 1 if sysid <= 10 else FURTHER_COMPANIONS_PORT + sysid - 11


def onboard_port(sysid: int, first: int = FIRST_ONBOARD_PORT) -> int:
    """From where a simulated autopilot speaks to its companion; companions answer to wherever they hear it.

    Args:
        sysid: of the vehicle.
        first: of vehicle 1; the others follow it one by one unless it is the usual one.

    Example:
        >>> onboard_port(1), onboard_port(120), onboard_port(121), onboard_port(250)
        (14580, 14699, 15300, 15429)
    """
    follows = sysid <= 120 or first != FIRST_ONBOARD_PORT
    return first + sysid - 1 if follows else FURTHER_ONBOARD_PORT + sysid - 121


def fleet_port(sysid: int) -> int:
    """Where a vehicle's companion listens to the other companions.

    Example:
        >>> fleet_port(1), fleet_port(250)
        (14700, 14949)
    """
    return FIRST_FLEET_PORT + sysid - 1
