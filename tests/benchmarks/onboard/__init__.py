"""The benchmark of the onboard planner: whole flights in process, with ideal tracking and a simulated range sensor.

`python -m tests.benchmarks.onboard --seeds 0:50` flies every world with every seed, prints what was found beside the
required figures, and ends with 1 if one of them is missed. `worlds` lays out what is flown through, `craft` is one
vehicle with its companion's own planner and flight logic, `flights` lets vehicles fly and scores them, `shortest` is
the length of the shortest way. Nothing of a world is known beforehand but the flight range.
"""
