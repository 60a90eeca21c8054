"""UDP ports that two programs must agree on without a word: where the companion of a vehicle listens."""

FIRST_COMPANION_PORT = 14540
FURTHER_COMPANIONS_PORT = 15050
"""Of vehicle 11: the ports of the first ten end before the ground station's, 14550."""


def companion_port(sysid: int) -> int:
    """Where a vehicle's companion listens, before any shift of all ports.

    Example:
        >>> companion_port(1), companion_port(10), companion_port(11), companion_port(250)
        (14540, 14549, 15050, 15289)
    """
    return FIRST_COMPANION_PORT + sysid - 1 if sysid <= 10 else FURTHER_COMPANIONS_PORT + sysid - 11
