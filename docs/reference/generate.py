"""Pages of the documentation that are made of the code when the site is built: command lines, the mission file."""

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

from missions.mission import Mission

PROGRAMS = ("gcs", "companion", "sitl")

MISSION_FILE = """# Mission file

One YAML file, read by all three programs; [a tutorial](../tutorials/write-a-mission.md) writes one. Keys that are not
in these tables are refused, with the line. Positions are metres east, north and up of `origin`. Types: `Positive` and
`NotNegative` are numbers, `Share` one from 0 to 1, `Point2` and `Point3` lists of two or three numbers, `Name` up to 40
letters, digits, spaces, `_`, `.` and `-`.
"""


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the generated pages; the hook that MkDocs calls once it knows the files."""
    for program in PROGRAMS:
        files.append(File.generated(config, f"reference/{program}.md", content=command_line(program)))
    files.append(File.generated(config, "reference/mission-file.md", content=mission_file()))
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
