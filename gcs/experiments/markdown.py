"""Markdown tables."""

from collections.abc import Sequence


def table(head: Sequence[str], lines: Sequence[Sequence[str]]) -> str:
    """A table; the first column is text, the others are numbers.

    Example:
        >>> print(table(["who", "f"], [["pso", "3.1"]]))
        | who | f |
        |---|---:|
        | pso | 3.1 |
    """
    rules = ["---"] + ["---:"] * (len(head) - 1)
    return "\n".join([_line(head), f"|{'|'.join(rules)}|", *(_line(line) for line in lines)])


def _line(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"
