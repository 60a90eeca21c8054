"""Write a generated mission as a file: `python -m missions.generators maze --seed 3 --output maze-3.yaml`."""

import argparse
import sys
from pathlib import Path

from missions.errors import MissionError
from missions.generators.catalogue import Kind, generate
from missions.mission_file import to_yaml


def main(arguments: list[str] | None = None) -> int:
    """Entry point; 0, or 2 for bad input."""
    parser = argparse.ArgumentParser(prog="python -m missions.generators", description=__doc__)
    parser.add_argument("kind", choices=[kind.value for kind in Kind])
    parser.add_argument("--seed", type=int, default=0, help="one seed, one world")
    parser.add_argument("--vehicles", type=int, help="how many; every kind has its own usual number")
    parser.add_argument("--output", type=Path, help="file to write; the screen without it")
    given = parser.parse_args(arguments)
    try:
        text = to_yaml(generate(Kind(given.kind), given.seed, given.vehicles))
        if given.output is None:
            print(text, end="")
        else:
            given.output.write_text(text)
    except (MissionError, OSError) as problem:
        print(f"missions.generators: {problem}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
