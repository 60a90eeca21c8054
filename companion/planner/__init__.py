"""The onboard planner: multi-objective particle swarm with weighted dominance and tabu search over cubic B-splines.

`Planner.plan` is the door. Everything in here is pure: a request, a random generator and the known obstacles go in, a
trajectory that ends at rest comes out. docs/maths/onboard-planner.md has the derivations; equation numbers are the
paper's.
"""
