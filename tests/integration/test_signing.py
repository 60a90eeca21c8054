"""Keys on the way to a vehicle, and what the vehicle's silence means, with the real programs."""

from pathlib import Path

import pytest

from tests.integration import programs
from tests.integration.sitl_process import free_instance_base, running_sitl


@pytest.mark.processes
def test_a_vehicle_is_given_a_key_over_a_trusted_link_and_then_another_one(tmp_path: Path):
    base, keys = free_instance_base(), ("--vehicle", "1", "--keys", str(tmp_path / "ring"))
    link = ("--trusted-link", f"udpin://127.0.0.1:{14550 + base}")
    with running_sitl("indoor", base=base):
        first = programs.run("gcs", "key", "install", *keys, *link)
        again = programs.run("gcs", "key", "install", *keys, *link)
        second = programs.run("gcs", "key", "rotate", *keys, *link)
    listed = programs.run("gcs", "key", "list", *keys[2:])
    assert (first.code, again.code, second.code, listed.code) == (0, 2, 0, 0), first.output + second.output
    assert "vehicle 1 has a key: `gcs key rotate` gives it another one" in again.output
    fingerprints = [done.output.split("signs with key ")[1].strip() for done in (first, second)]
    assert fingerprints[0] != fingerprints[1]
    assert "SIGNED" in listed.output
    assert fingerprints[1] in listed.output
    assert (tmp_path / "ring/keys").read_text().split()[1] not in first.output + second.output + listed.output
