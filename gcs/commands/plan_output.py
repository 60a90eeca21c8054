"""What `gcs plan --output` writes: the plan as JSON, or one file per vehicle for other ground stations."""

from pathlib import Path

import msgspec

from gcs.commands.convert import write_text
from gcs.errors import UsageError
from gcs.planner.plan import FleetPlan
from missions.mission import Mission

SUFFIXES = (".json", ".plan", ".waypoints")


def check_output(path: Path) -> None:
    """Refuse what cannot be written before anything is worked out.

    Raises:
        UsageError: another suffix, or no such folder.
    """
    if path.suffix not in SUFFIXES:
        raise UsageError(f"--output {path}: expected a name that ends in {', '.join(SUFFIXES)}")
    if not path.parent.is_dir():
        raise UsageError(f"--output {path}: cannot be written: {path.parent} is no directory")


def write_plan(path: Path, mission: Mission, plan: FleetPlan) -> list[str]:
    """Write a plan; a line on each file.

    `x.plan` and `x.waypoints` become one file per vehicle, `x-<name>.plan`, for an autopilot that stands on its pad.

    Raises:
        UsageError: a file cannot be written, or nobody should fly what would be in it.
    """
    from gcs.files.conversion import Format, format_document, format_of
    from gcs.files.sources import vehicle_document

    if path.suffix == ".json":
        write_text(path, plan.to_json())
        return [f"plan: {path}"]
    if not plan.feasible:
        raise UsageError(f"--output {path}: the plan is not feasible; only .json takes one that must not be flown")
    kind = format_of(path)
    lines: list[str] = []
    for part in plan.vehicles:
        document = vehicle_document(mission, plan, part)
        if kind is Format.WAYPOINTS:
            document = msgspec.structs.replace(document, polygons=(), circles=())
        target = path.with_name(f"{path.stem}-{part.name}{path.suffix}")
        text, notes = format_document(document, str(target), kind)
        write_text(target, text)
        lines += [f"plan of {part.name}: {target}, {', '.join(document.contents)}", *notes]
    return lines + (["the fence is not in .waypoints: .plan has it"] if kind is Format.WAYPOINTS else [])
