"""Missions as files that `load_mission` reads back as the same missions."""

from collections.abc import Sequence
from typing import Any, cast

import msgspec
import yaml

from missions.mission import Mission


def to_yaml(mission: Mission) -> str:
    """The mission as a mission file. A file's comments are not part of a mission, and are not written."""
    return yaml.safe_dump(
        _without_none(msgspec.to_builtins(mission)), sort_keys=False, default_flow_style=None, width=120
    )


def _without_none(value: Any) -> Any:
    if isinstance(value, dict):
        fields = cast(dict[str, Any], value)
        return {key: _without_none(inner) for key, inner in fields.items() if inner is not None}
    if isinstance(value, list | tuple):
        return [_without_none(inner) for inner in cast(Sequence[Any], value)]
    return value
