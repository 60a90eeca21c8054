"""Pages of the documentation that are made of the code when the site is built: programs, mission file, parameters."""

import dataclasses
import inspect
import re
import subprocess
import sys
import typing
from enum import Enum

import griffe
import msgspec
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from companion.fleet.fleet_settings import FleetSettings
from companion.settings import PilotSettings, Reserve, SearchSettings
from gcs.flight.safety_parameters import requirements
from gcs.planner.ecpso import EcpsoSettings
from gcs.replanning.replanner import ReplanSettings
from missions.mission import Mission, load_mission
from sitl.autopilot.parameter_table import parameter_table
from sitl.dynamics.airframe import X500_LIKE

PROGRAMS = ("gcs", "companion", "sitl")

MISSION_FILE = """# Mission file

One YAML file, read by all three programs; [a tutorial](../tutorials/write-a-mission.md) writes one. Keys that are not
in these tables are refused, with the line. Positions are metres east, north and up of `origin`. Types: `Positive` and
`NotNegative` are numbers, `Share` one from 0 to 1, `Point2` and `Point3` lists of two or three numbers, `Name` up to 40
letters, digits, spaces, `_`, `.` and `-`.
"""

PARAMETERS = """# Parameters

What a user sets stands in the [mission file](mission-file.md) and on the command lines. This page has what lies behind:
parameters of autopilots, with PX4's names, and the constants of planners and pilot, which are fields of the named class
in the code and are changed there, with a benchmark beside.
"""

REQUIRED = """## What a flight requires of an autopilot

Read before arming and, where the mission says `set_parameters: true`, set. Values for the mission `field` at speed 1.

| parameter | value | why |
|---|---|---|
"""

SIMULATED = """
## Of the simulated autopilot

PX4's names, types and defaults, explained in PX4's own parameter reference. Any finite value is stored; applied is the
value within the range. `gcs params` lists and sets them, `sitl --parameters FOLDER` keeps them.

| parameter | type | default | applied range |
|---|---|---|---|
"""

CONSTANTS = (EcpsoSettings, ReplanSettings, Reserve, SearchSettings, PilotSettings, FleetSettings)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages; the hook that MkDocs calls once it knows the files."""
    for program in PROGRAMS:
        files.append(File.generated(config, f"reference/{program}.md", content=command_line(program)))
    files.append(File.generated(config, "reference/mission-file.md", content=mission_file()))
    files.append(File.generated(config, "reference/parameters.md", content=parameters()))
    return files


def command_line(program: str) -> str:
    """A program's commands and options, in Markdown."""
    made = subprocess.run(
        [sys.executable, "-m", "typer", f"{program}.cli", "utils", "docs", "--name", program],
        check=True,
        capture_output=True,
        text=True,
    )
    return made.stdout


def parameters() -> str:
    """Parameters that are required of autopilots, those of the simulated one, and the constants of our programs."""
    required = (f"| `{one.name}` | {_bound(one.less_is_fine)}{one.value:g} | {one.why} |" for one in _required())
    simulated = (
        f"| `{one.name}` | {'INT32' if isinstance(one.default, int) else 'FLOAT'} | {one.default:.9g} "
        f"| {one.low:.9g} to {one.high:.9g} |"
        for one in parameter_table(X500_LIKE)
    )
    tables = [PARAMETERS, REQUIRED + "\n".join(required), SIMULATED + "\n".join(simulated) + "\n"]
    return "\n".join(tables + [_constants(settings) for settings in CONSTANTS])


def _required() -> tuple[typing.Any, ...]:
    return requirements(load_mission("field"), 1.0)


def _bound(less_is_fine: bool) -> str:
    return "at most " if less_is_fine else ""


def _constants(settings: type) -> str:
    """One of our programs' dataclasses of constants."""
    source = griffe.load(settings.__module__)[settings.__name__]
    about = f"{inspect.getdoc(settings)}".partition("\n\nArgs:")[0]
    head = f"## {settings.__name__}\n\n`{settings.__module__}`: {about}\n\n| field | value | |\n|---|---|---|"
    arguments = _arguments(source)
    return "\n".join(
        [head, *(_constant(field, source[field.name], arguments) for field in dataclasses.fields(settings)), ""]
    )


def _arguments(source: griffe.Object | griffe.Alias) -> dict[str, str]:
    """What a class's docstring says of its fields, where it says it there."""
    sections = source.docstring.parse("google") if source.docstring else []
    listed = [section.value for section in sections if section.kind is griffe.DocstringSectionKind.parameters]
    return {one.name: one.description for group in listed for one in group}


def _constant(
    field: dataclasses.Field[typing.Any], source: griffe.Object | griffe.Alias, arguments: dict[str, str]
) -> str:
    meaning = source.docstring.value if source.docstring else arguments.get(field.name, "")
    meaning = meaning.replace("\n", " ")
    return f"| `{field.name}` | {field.default} | {meaning} |"


def mission_file() -> str:
    """A table per part of a mission: keys, types, defaults, and what they mean."""
    return "\n".join([MISSION_FILE, *(_section(part) for part in _parts(Mission, []))])


def _parts(found: object, parts: list[type]) -> list[type]:
    """A type and all Structs and Enums that it is made of, in order of appearance."""
    if isinstance(found, type) and issubclass(found, msgspec.Struct | Enum) and found not in parts:
        parts.append(found)
        for inner in typing.get_type_hints(found).values() if issubclass(found, msgspec.Struct) else ():
            _parts(inner, parts)
    for inner in typing.get_args(found):
        _parts(inner, parts)
    return parts


def _section(part: type) -> str:
    source = griffe.load(part.__module__)[part.__name__]
    head = f"## {part.__name__}\n\n{inspect.getdoc(part)}\n"
    if issubclass(part, Enum):
        return head + "\nOne of " + ", ".join(f"`{member.value}`" for member in part) + ".\n"
    rows = [_row(field, source[field.name]) for field in msgspec.structs.fields(part)]
    tag = part.__struct_config__.tag
    chosen = [] if tag is None else [f"| `type` | `{tag}` | required | which of these it is |"]
    return "\n".join([head, "| key | type | default | |", "|---|---|---|---|", *chosen, *rows, ""])


def _row(field: msgspec.structs.FieldInfo, source: griffe.Object | griffe.Alias) -> str:
    meaning = source.docstring.value.replace("\n", " ") if source.docstring else ""
    return f"| `{field.encode_name}` | {_kind(source)} | {_default(field)} | {meaning} |"


def _kind(source: griffe.Object | griffe.Alias) -> str:
    """A field's type as its declaration has it, in the words of YAML."""
    kind = re.sub(r"Annotated\[(.*), msgspec\.Meta\(.*\)\]", r"\1", str(source.annotation))
    return re.sub(r"tuple\[([^,]*), \.\.\.\]", r"list of \1", kind).replace("None", "null").replace("|", "or")


def _default(field: msgspec.structs.FieldInfo) -> str:
    if field.required:
        return "required"
    if isinstance(field.default, msgspec.Struct):
        return "its defaults"
    return f"`{msgspec.json.encode(field.default).decode()}`"
