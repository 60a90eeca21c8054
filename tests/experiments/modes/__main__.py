"""`make experiment-modes SEEDS=A:B`: three modes in worlds unlike their maps; fails where a promise is not kept."""

import sys

from tests.experiments.command_line import run
from tests.experiments.modes.experiment import EXPERIMENT, shortfalls

if __name__ == "__main__":
    sys.exit(run(EXPERIMENT, shortfalls, __doc__))
