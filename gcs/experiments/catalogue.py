"""All experiments by name."""

from gcs.errors import UsageError
from gcs.experiments import table2
from gcs.experiments.experiment import Experiment

EXPERIMENTS: dict[str, Experiment] = {each.EXPERIMENT.name: each.EXPERIMENT for each in (table2,)}


def find_experiment(name: str) -> Experiment:
    """The experiment of that name.

    Raises:
        UsageError: there is none.
    """
    if name not in EXPERIMENTS:
        raise UsageError(f"experiment {name}: expected one of {', '.join(EXPERIMENTS)}")
    return EXPERIMENTS[name]
