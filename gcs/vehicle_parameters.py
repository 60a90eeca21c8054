"""What an operator does with a vehicle's parameters: fetch them all, set some of them, see each one set."""

from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path

from gcs.dialect import AUTOPILOT
from gcs.errors import ParameterError
from gcs.folders import kept_parameters_file
from gcs.microservices.kept_parameters import decode_kept, encode_kept
from gcs.microservices.parameter_client import ParameterExchange, Value
from gcs.microservices.parameter_fetch import Parameter, ParameterFetch, ParameterSet
from gcs.microservices.parameter_files import shown_value
from gcs.station import Station

MOST_BYTES = 4 << 20


async def fetch(station: Station, sysid: int) -> Mapping[str, Parameter]:
    """All parameters of a vehicle; from the kept copy if the vehicle's hash says that it is the same.

    Raises:
        ParameterError: no answer, or some are missing after many requests.
    """
    path = kept_parameters_file(sysid)
    found = (await station.run(ParameterFetch((sysid, AUTOPILOT), _kept(path)))).result
    assert found is not None  # the exchange ends with a result or raises
    data = encode_kept(found)
    if data is not None:
        with suppress(OSError):  # the next fetch takes longer
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)
    return found.values


async def get(station: Station, sysid: int, name: str) -> Value:
    """One parameter.

    Raises:
        ParameterError: no answer; a PX4 answers nothing to a name that it does not know.
    """
    value = (await station.run(ParameterExchange((sysid, AUTOPILOT), name))).value
    assert value is not None  # as above
    return value


async def set_all(
    station: Station, sysid: int, values: Mapping[str, Value], say: Callable[[str], None]
) -> dict[str, str]:
    """Set parameters one after the other, each until the vehicle shows it set.

    Returns:
        what could not be set: name -> why. All others are set.
    """
    failed: dict[str, str] = {}
    for name, value in values.items():
        try:
            await station.run(ParameterExchange((sysid, AUTOPILOT), name, new_value=value))
        except ParameterError as problem:
            failed[name] = str(problem)
            say(str(problem))
        else:
            say(f"vehicle {sysid}: {name} is {shown_value(value)}")
    return failed


def _kept(path: Path) -> ParameterSet | None:
    try:
        with path.open("rb") as file:
            return decode_kept(file.read(MOST_BYTES))
    except OSError:
        return None
