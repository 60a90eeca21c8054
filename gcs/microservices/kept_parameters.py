"""The copy of a vehicle's parameters that is kept between fetches, as bytes; its own `_HASH_CHECK` says if it holds."""

import math

import msgspec

from gcs.microservices.parameter_client import Value
from gcs.microservices.parameter_fetch import MOST_PARAMETERS, Parameter, ParameterSet


class _Kept(msgspec.Struct, frozen=True):
    hash_check: int
    values: dict[str, tuple[Value, int]]


def encode_kept(parameters: ParameterSet) -> bytes | None:
    """What is to be kept; None of a vehicle that has no hash, since nobody could tell when it is out of date."""
    if parameters.hash_check is None:
        return None
    values = {name: (parameter.value, parameter.kind) for name, parameter in parameters.values.items()}
    return msgspec.json.encode(_Kept(parameters.hash_check, values))


def decode_kept(data: bytes) -> ParameterSet | None:
    """What was kept; None where that cannot be read: then everything is fetched."""
    try:
        kept = msgspec.json.decode(data, type=_Kept)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
        return None
    if not 0 < len(kept.values) <= MOST_PARAMETERS or not all(
        math.isfinite(value) for value, _ in kept.values.values()
    ):
        return None
    return ParameterSet({name: Parameter(*both) for name, both in kept.values.items()}, kept.hash_check)
