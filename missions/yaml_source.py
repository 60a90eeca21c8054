"""YAML files into frozen structs, with the file and line of whatever is wrong in them."""

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar, cast

import msgspec
import yaml

from missions.errors import ConfigError

MAX_BYTES = 1_000_000
MAX_DEPTH = 20

T = TypeVar("T")

_PLACE = re.compile(r"^(?P<problem>.*?)(?: - at `\$\.?(?P<key>.*)`)?$", re.DOTALL)
_UNKNOWN_FIELD = re.compile(r"unknown field `(?P<name>[^`]*)`")


class _Loader(yaml.SafeLoader):
    """YAML without aliases: a few of them make a small file expand without end."""

    if TYPE_CHECKING:  # the types that PyYAML's stubs leave out

        def check_event(self, *choices: type[yaml.Event]) -> bool: ...
        def peek_event(self) -> yaml.Event: ...
        def construct_document(self, node: yaml.Node) -> Any: ...

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        if self.check_event(yaml.AliasEvent):
            mark = self.peek_event().start_mark
            raise yaml.MarkedYAMLError(None, None, "aliases (*name) are not supported", mark)
        return super().compose_node(parent, index)


class SourceMap:
    """Where each key of one YAML document stands: `world.boxes[0].half_m` -> line number."""

    def __init__(self, path: Path, root: yaml.Node) -> None:
        self.path = path
        self._lines = dict(_walk(path, root, "", 0))

    def line(self, key: str) -> int:
        """1-based line of `key`, or of the nearest thing around it that is in the file."""
        while key not in self._lines:
            key = re.sub(r"(?:\.|^)[^.\[\]]*$|\[[^\[\]]*\]$", "", key)
        return self._lines[key]

    def error(self, key: str, problem: str) -> ConfigError:
        return ConfigError(self.path, self.line(key), key, problem)


def load_struct(path: Path, kind: type[T]) -> tuple[T, SourceMap]:
    """Read `path` as YAML into a `kind`, a msgspec Struct that refuses unknown keys.

    Returns:
        the struct, and the map from its keys to lines, for checks that come later.

    Raises:
        ConfigError: the file cannot be read, is no YAML, names a key twice, has a number that is not finite,
            or does not fit `kind`; the error names file, line, key, what was expected and what was found.
    """
    source, data = parse(path)
    try:
        return msgspec.convert(data, kind), source
    except msgspec.ValidationError as invalid:
        match = _PLACE.match(str(invalid))
        assert match is not None  # the pattern matches any text
        problem, key = match["problem"], _real_key(match["key"] or "")
        unknown = _UNKNOWN_FIELD.search(problem)
        line_key = f"{key}.{unknown['name']}".lstrip(".") if unknown else key
        found = _lookup(data, key)
        if problem.startswith("Expected") and ", got" not in problem and not isinstance(found, dict | list):
            problem = f"{problem}, got {found!r}"
        raise ConfigError(path, source.line(line_key), key, problem) from None


def parse(path: Path) -> tuple[SourceMap, Any]:
    """Read one YAML document into plain Python data.

    Raises:
        ConfigError: as for `load_struct`, but for the last reason.
    """
    try:
        raw = path.read_bytes()
    except OSError as problem:
        raise ConfigError(path, None, "", f"cannot be read: {problem.strerror}") from None
    if len(raw) > MAX_BYTES:
        raise ConfigError(path, None, "", f"expected at most {MAX_BYTES} bytes, found {len(raw)}")
    try:
        loader = _Loader(raw)
        root = loader.get_single_node()
        if root is None:
            raise ConfigError(path, None, "", "the file is empty")
        source = SourceMap(path, root)
        data = loader.construct_document(root)
        _refuse_not_finite(source, data, "")
        return source, data
    except yaml.MarkedYAMLError as problem:
        mark = problem.problem_mark or problem.context_mark
        line = mark.line + 1 if mark else None
        raise ConfigError(path, line, "", f"not valid YAML: {problem.problem or problem.context}") from None
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError, ValueError) as problem:
        raise ConfigError(path, None, "", f"not valid YAML: {problem}") from None


def _walk(path: Path, node: yaml.Node, key: str, depth: int) -> Iterator[tuple[str, int]]:
    """Yield (key path, line) of all nodes; refuse doubled keys."""
    line = node.start_mark.line + 1
    if depth > MAX_DEPTH:
        raise ConfigError(path, line, key, f"nested deeper than {MAX_DEPTH} levels")
    yield key, line
    if isinstance(node, yaml.MappingNode):
        names: set[str] = set()
        for name_node, value in node.value:
            name = str(name_node.value)
            if name in names:
                raise ConfigError(path, name_node.start_mark.line + 1, key, f"key `{name}` stands here twice")
            names.add(name)
            child = f"{key}.{name}" if key else name
            yield from _walk(path, value, child, depth + 1)
            yield child, name_node.start_mark.line + 1
    elif isinstance(node, yaml.SequenceNode):
        for index, value in enumerate(node.value):
            yield from _walk(path, value, f"{key}[{index}]", depth + 1)


def _refuse_not_finite(source: SourceMap, data: object, key: str) -> None:
    if isinstance(data, dict):
        for name, value in cast(dict[object, object], data).items():
            _refuse_not_finite(source, value, f"{key}.{name}" if key else str(name))
    elif isinstance(data, list):
        for index, value in enumerate(cast(list[object], data)):
            _refuse_not_finite(source, value, f"{key}[{index}]")
    elif isinstance(data, float) and not math.isfinite(data):
        raise source.error(key, f"expected a finite number, found {data}")


def _real_key(key: str) -> str:
    """`key` up to the `[...]` that msgspec writes for a dictionary's value."""
    return key.partition("[...]")[0]


def _lookup(data: Any, key: str) -> Any:
    """The value that stands at `key`, or None."""
    for name, index in re.findall(r"([^.\[\]]+)|\[(\d+)\]", key):
        try:
            data = data[name] if name else data[int(index)]
        except (KeyError, IndexError, TypeError):
            return None
    return data
