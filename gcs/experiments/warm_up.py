"""Compiling everything that experiments use, once per process, before anything is measured."""

import functools

from gcs.experiments.trials import Trial, attempt
from gcs.planner import compile_kernels
from gcs.planner.baselines import COMPARED, Representation
from missions.kernels import one_at_a_time


@functools.cache
def warm_up() -> None:
    """Compile the kernels of planner and baselines, or load what was compiled before."""
    compile_kernels()
    with one_at_a_time("gcs"):
        for representation in Representation:
            for algorithm in COMPARED:
                attempt(Trial("indoor", algorithm, representation, evaluations=1, seed=0))
