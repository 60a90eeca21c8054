"""What the simulator costs, with the required figures: CPU time, memory, pace and boot.

    python -m tests.benchmarks.sitl         about a minute (make bench-sitl)

docs/results/simulator-benchmark.md says how to read what it prints.
"""
