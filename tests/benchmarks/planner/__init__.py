"""The cloud planner beside its peers: the same missions, numbers, evaluation and judge, CPU time of one thread.

    python -m tests.benchmarks.planner --seeds 0:30         all of it: about an hour (make bench-planner SEEDS=0:30)
    python -m tests.benchmarks.planner --quick              two seeds and a few worlds: less than two minutes

Needs the extra `bench`. docs/results/planner-benchmark.md says how to read what it prints.
"""
