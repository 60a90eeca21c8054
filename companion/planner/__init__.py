"""The onboard planner: multi-objective particle swarm with weighted dominance and tabu search over cubic B-splines.

Layers, each importing only what stands below it: `planner` (the door: `Planner.plan`) > `guide` (the way that remains)
> `grid_search` (around what blocks it), and beside these `local_plan` (one replan) > `mopso` (the swarm) > `archive`,
`tabu` > `dominance` > `evaluation` (what a candidate is worth). Below all: `reference` > `limits`. `safety` and
`braking` look after trajectories that are flown; `spline_shape` holds constants.

Everything in here is pure: a request, a random generator and the known obstacles go in, a trajectory that ends at rest
comes out. docs/maths/onboard-planner.md has the method; equation numbers are the paper's.
"""
