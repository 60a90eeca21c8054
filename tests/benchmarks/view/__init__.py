"""What the web page costs: `python -m tests.benchmarks.view` (`make bench-view`).

A real server, connections that read as browsers do, fast and slow, and one real browser; required figures of a fleet
of 100 with trails at 10 Hz.
"""
