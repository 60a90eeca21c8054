"""How much of the benchmark is run: all of it, or a few minutes' worth while developing."""

from dataclasses import dataclass

from tests.benchmarks.planner.peers import PEERS

NEAREST = ("pycma", "scipy L-BFGS-B")
"""The peers that come nearest: they alone fly the generated terrains."""


@dataclass(frozen=True)
class Scope:
    """What is run.

    Args:
        seeds: of the planner, and of the worlds where these are generated.
        terrains: how many of Table 2's.
        peers: by name.
        peer_runs: seeds of each peer on each world.
        peer_s: CPU time of one run of a peer on five vehicles; with ten, twice as much.
        generated: how many generated terrains of each size ...
        generated_runs: ... seeds of the planner on each ...
        contested: ... and on how many of them peers are run.
        fleets: numbers of vehicles.
        fleet_runs: at most so many seeds of each.
        hard_runs: at most so many seeds of each hard kind.
        hard_s: CPU time of everybody on a hard world.
    """

    seeds: range
    terrains: int = 3
    peers: tuple[str, ...] = tuple(PEERS)
    peer_runs: int = 5
    peer_s: float = 3.0
    generated: int = 20
    generated_runs: int = 3
    contested: int = 5
    fleets: tuple[int, ...] = (50, 100)
    fleet_runs: int = 30
    hard_runs: int = 30
    hard_s: float = 2.0


def quick(seeds: range) -> Scope:
    """Less than two minutes."""
    return Scope(
        seeds[:2],
        terrains=1,
        peers=NEAREST,
        peer_runs=1,
        generated=2,
        generated_runs=1,
        contested=0,
        fleets=(50,),
        fleet_runs=1,
        hard_runs=1,
        hard_s=1.0,
    )
