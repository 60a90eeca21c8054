"""More targets than vehicles: who visits which of them, in which order, so that routes are short and balanced.

The vehicles of a plan arrive together, so the longest route decides, and after it the next: minimised is the sum of
the eighth powers of the routes' lengths. Targets are inserted where they cost least, the farthest first; then single
targets move to better places, stretches of routes are flown the other way round and two routes exchange their tails,
until nothing is gained (moves of Or 1976, Croes 1958, and Potvin and Rousseau 1995).
"""

import itertools

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Routes = list[list[int]]

BALANCE = 8
"""The power: with one, routes are short in total; the higher, the more the longest one counts."""
LEAST_GAIN = 1e-9
"""Relative, for the rounding of sums alone."""


def balanced_routes(table_m: Array) -> Routes:
    """Targets of each vehicle in flying order.

    Args:
        table_m: (vehicles + targets, targets) lengths of the ways from every start and target to every target.
    """
    n_vehicles = len(table_m) - table_m.shape[1]
    routes: Routes = [[] for _ in range(n_vehicles)]
    for target in np.argsort(-table_m[:n_vehicles].min(axis=0), kind="stable").tolist():
        _insert(table_m, routes, target)
    lightest = weight(table_m, routes)
    while True:
        for target in range(table_m.shape[1]):
            _move(table_m, routes, target)
        for vehicle, route in enumerate(routes):
            routes[vehicle] = _turned(table_m, vehicle, n_vehicles, route)
        for one, other in itertools.combinations(range(n_vehicles), 2):
            _exchange_tails(table_m, routes, one, other)
        found = weight(table_m, routes)
        if found >= lightest * (1.0 - LEAST_GAIN):
            return routes
        lightest = found


def route_length(table_m: Array, vehicle: int, n_vehicles: int, route: list[int]) -> float:
    """Length [m] of one route by a table of lengths (see `balanced_routes`)."""
    before = [vehicle, *(n_vehicles + target for target in route)]
    return float(table_m[before[:-1], route].sum())


def weight(table_m: Array, routes: Routes) -> float:
    """What is minimised: the sum of powers of the routes' lengths."""
    n = len(routes)
    return sum(route_length(table_m, vehicle, n, route) ** BALANCE for vehicle, route in enumerate(routes))


def _move(table_m: Array, routes: Routes, target: int) -> None:
    """Take a target out of its route and put it where it costs least."""
    for route in routes:
        if target in route:
            route.remove(target)
    _insert(table_m, routes, target)


def _insert(table_m: Array, routes: Routes, target: int) -> None:
    """Put a target where the sum of powers grows least."""
    n, best = len(routes), (np.inf, 0, 0)
    for vehicle, route in enumerate(routes):
        before = np.array([vehicle, *(n + other for other in route)])
        detour_m = table_m[before, target]
        if route:
            detour_m[:-1] += table_m[n + target, route] - table_m[before[:-1], route]
        at, length_m = int(np.argmin(detour_m)), route_length(table_m, vehicle, n, route)
        grown = (length_m + float(detour_m[at])) ** BALANCE - length_m**BALANCE
        best = min(best, (grown, vehicle, at))
    _, vehicle, at = best
    routes[vehicle].insert(at, target)


def _exchange_tails(table_m: Array, routes: Routes, one: int, other: int) -> None:
    """Let two routes go on as each other where that makes the sum of powers least."""
    n, a, b = len(routes), routes[one], routes[other]
    before_a, before_b = [one, *(n + target for target in a)], [other, *(n + target for target in b)]
    flown_a = np.concatenate(([0.0], np.cumsum(table_m[before_a[:-1], a])))
    flown_b = np.concatenate(([0.0], np.cumsum(table_m[before_b[:-1], b])))
    a_then_b, b_then_a = np.zeros((2, len(a) + 1, len(b) + 1))
    a_then_b[:, :-1] = table_m[np.ix_(before_a, b)] + flown_b[-1] - flown_b[1:]
    b_then_a[:-1] = (table_m[np.ix_(before_b, a)] + flown_a[-1] - flown_a[1:]).T
    powers = (flown_a[:, None] + a_then_b) ** BALANCE + (flown_b + b_then_a) ** BALANCE
    i, j = np.unravel_index(int(np.argmin(powers)), powers.shape)
    if powers[i, j] < flown_a[-1] ** BALANCE + flown_b[-1] ** BALANCE:
        routes[one], routes[other] = a[:i] + b[j:], b[:j] + a[i:]


def _turned(table_m: Array, vehicle: int, n_vehicles: int, route: list[int]) -> list[int]:
    """The route with the stretch reversed that shortens it most, if any does."""
    turned = [
        route[:begin] + route[begin:end][::-1] + route[end:]
        for begin in range(len(route))
        for end in range(begin + 2, len(route) + 1)
    ]
    return min([route, *turned], key=lambda order: route_length(table_m, vehicle, n_vehicles, order))
