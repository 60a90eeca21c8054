"""What the paper prints, and what is known of its worlds."""

from dataclasses import dataclass

ALGORITHMS = ("pso", "ecpso", "ipso", "gapso", "ca", "aca")
"""In the order of table 2."""


@dataclass(frozen=True)
class Printed:
    """A cell of table 2: iterations at the beginning of convergence, and the objective's value at convergence."""

    ibc: int
    fvc: float


_TERRAINS = {
    1: {
        "pso": ((82, 3128.6), (113, 6034.5)),
        "ecpso": ((56, 1834.4), (86, 3179.6)),
        "ipso": ((88, 2465.2), (121, 4528.3)),
        "gapso": ((96, 2104.3), (134, 4019.1)),
        "ca": ((72, 3104.6), (98, 6194.4)),
        "aca": ((105, 2923.5), (107, 5478.5)),
    },
    2: {
        "pso": ((78, 3364.7), (121, 6823.1)),
        "ecpso": ((52, 2023.2), (92, 4435.3)),
        "ipso": ((84, 2675.4), (125, 5287.2)),
        "gapso": ((95, 2392.9), (138, 4963.4)),
        "ca": ((74, 2989.6), (111, 5892.3)),
        "aca": ((96, 3045.2), (103, 6102.2)),
    },
    3: {
        "pso": ((134, 3578.6), None),
        "ecpso": ((112, 2149.1), (157, 4752.8)),
        "ipso": ((146, 2538.3), (172, 6272.2)),
        "gapso": ((151, 2414.7), None),
        "ca": ((128, 3192.2), (169, 6490.5)),
        "aca": ((123, 3234.7), (174, 6189.8)),
    },
}

BEST_KNOWN = {
    "terrain-1-5uav": 1419.2,
    "terrain-2-5uav": 1488.3,
    "terrain-3-5uav": 1530.7,
    "terrain-1-10uav": 2796.1,
    "terrain-2-10uav": 2956.0,
    "terrain-3-10uav": 3042.4,
}
"""f*, without caps: the least objective of a feasible plan that long searches have found."""

MISSIONS = tuple(BEST_KNOWN)
"""The worlds of table 2."""


def printed(mission: str, algorithm: str) -> Printed | None:
    """The paper's cell; None where it prints none, because planning did not succeed."""
    terrain, fleet = mission.removeprefix("terrain-").split("-")
    cell = _TERRAINS[int(terrain)][algorithm][0 if fleet == "5uav" else 1]
    return None if cell is None else Printed(*cell)
