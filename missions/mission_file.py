"""Missions as files that `load_mission` reads back as the same missions."""

from typing import Any

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
        return {key: _without_none(inner) for key, inner in value.items() if inner is not None}
    return [_without_none(inner) for inner in value] if isinstance(value, list | tuple) else value
