"""`make experiment-missions SEEDS=A:B`: every shipped mission, flown in full; fails where one does not succeed."""

import sys

from tests.experiments.command_line import run
from tests.experiments.missions.experiment import EXPERIMENT, shortfalls

if __name__ == "__main__":
    sys.exit(run(EXPERIMENT, shortfalls, __doc__))
