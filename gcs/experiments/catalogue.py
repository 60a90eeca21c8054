"""All experiments by name."""

from gcs.errors import UsageError
from gcs.experiments import ablation, ackley, allocation, convergence, paths, scaling, table2
from gcs.experiments.experiment import Experiment

_MODULES = (ackley, allocation, paths, convergence, table2, ablation, scaling)
EXPERIMENTS: dict[str, Experiment] = {module.EXPERIMENT.name: module.EXPERIMENT for module in _MODULES}


def find_experiment(name: str) -> Experiment:
    """The experiment of that name.

    Raises:
        UsageError: there is none.
    """
    if name not in EXPERIMENTS:
        raise UsageError(f"experiment {name}: expected one of {', '.join(EXPERIMENTS)}")
    return EXPERIMENTS[name]
