"""The length of the shortest way across a course, as flown paths are compared with: exact, in the plane.

Everything solid is grown by the clearance that is to be kept and becomes discs (a box: its four corners); the shortest
way consists of common tangents of two discs and of arcs. Ways over the top of things are longer in all these worlds.
"""

import heapq
import itertools
from collections import defaultdict

import numpy as np
import numpy.typing as npt

from missions.world import World
from tests.benchmarks.onboard.worlds import Course

Array = npt.NDArray[np.float64]

TOUCHING_M = 1e-6
ARC_PROBES = 8
LONGEST = 1.15
"""Ways that lead farther off, in lengths of the straight line, are not looked for."""


def shortest_m(course: Course, index: int = 0) -> float:
    """Length [m] of the shortest level way of one vehicle from its start to its goal; infinite when there is none."""
    clearance_m = course.mission.limits.clearance_m
    discs, boxes = solids(course.mission.world, clearance_m)
    ends = np.array([[*course.starts_m[index, :2], 0.0], [*course.goals_m[index, :2], 0.0]])
    circles = np.vstack((ends, discs))  # the ends are circles of no radius
    i, j = np.triu_indices(len(circles), 1)
    lines = np.vstack([tangents(circles, i, j, a, b) for a, b in itertools.product((1.0, -1.0), (1.0, -1.0))])
    detour_m = np.hypot(*(lines[:, :2] - ends[0, :2]).T) + np.hypot(*(lines[:, :2] - ends[1, :2]).T)
    lines = lines[detour_m < LONGEST * np.hypot(*(ends[1, :2] - ends[0, :2]))]
    lines = lines[~crossed(lines[:, :2], lines[:, 2:4], discs, boxes)]
    return dijkstra(circles, lines, discs, boxes)


def solids(world: World, clearance_m: float) -> tuple[Array, Array]:
    """(d, 3) discs: centre and radius; (b, 4) boxes: centre and half sizes, not grown."""
    discs = [(*tree.centre_m, tree.radius_m + clearance_m) for tree in world.cylinders]
    for box in world.boxes:
        for x, y in itertools.product((-1, 1), (-1, 1)):
            discs.append((box.centre_m[0] + x * box.half_m[0], box.centre_m[1] + y * box.half_m[1], clearance_m))
    grown = [(*box.centre_m[:2], box.half_m[0] + clearance_m, box.half_m[1]) for box in world.boxes]
    grown += [(*box.centre_m[:2], box.half_m[0], box.half_m[1] + clearance_m) for box in world.boxes]
    return np.array(discs).reshape(-1, 3), np.array(grown).reshape(-1, 4)


def tangents(circles: Array, i: npt.NDArray[np.int64], j: npt.NDArray[np.int64], side_i: float, side_j: float) -> Array:
    """(n, 6) common tangents of pairs of circles, that touch each on a given side: both ends, the circles' numbers."""
    reach_i, reach_j = side_i * circles[i, 2], side_j * circles[j, 2]
    off = circles[j, :2] - circles[i, :2]
    cosine = (reach_i - reach_j) / np.maximum(np.hypot(*off.T), 1e-12)
    doubled = ((side_i < 0) & (circles[i, 2] == 0.0)) | ((side_j < 0) & (circles[j, 2] == 0.0))
    kept = (np.abs(cosine) <= 1.0) & ~doubled
    i, j, reach_i, reach_j = i[kept], j[kept], reach_i[kept], reach_j[kept]
    angle = np.arctan2(off[kept, 1], off[kept, 0]) + np.arccos(cosine[kept])
    normal = np.column_stack((np.cos(angle), np.sin(angle)))
    a, b = circles[i, :2] + reach_i[:, None] * normal, circles[j, :2] + reach_j[:, None] * normal
    return np.column_stack((a, b, i, j))


def crossed(a: Array, b: Array, discs: Array, boxes: Array) -> npt.NDArray[np.bool_]:
    """(n,) which of the lines from (n, 2) to (n, 2) cross a disc or a box."""
    along = b - a
    squared = np.maximum((along**2).sum(axis=1), 1e-12)
    out = np.zeros(len(a), dtype=bool)
    for x, y, r in discs:
        share = np.clip((((x, y) - a) * along).sum(axis=1) / squared, 0.0, 1.0)
        out |= np.hypot(*(a + share[:, None] * along - (x, y)).T) < r - TOUCHING_M
    for x, y, half_x, half_y in boxes:
        safe = np.where(np.abs(along) < 1e-12, 1e-12, along)
        one, other = ((x - half_x, y - half_y) - a) / safe, ((x + half_x, y + half_y) - a) / safe
        enters, leaves = np.minimum(one, other).max(axis=1), np.maximum(one, other).min(axis=1)
        out |= np.maximum(enters, 0.0) < np.minimum(leaves, 1.0) - TOUCHING_M
    return out


def dijkstra(circles: Array, lines: Array, discs: Array, boxes: Array) -> float:
    """Length of the shortest way from the first circle to the second, over lines and arcs."""
    points = np.vstack((lines[:, :2], lines[:, 2:4]))
    owner = np.concatenate((lines[:, 4], lines[:, 5])).astype(int)
    graph: dict[int, list[tuple[int, float]]] = defaultdict(list)

    def join(i: int, j: int, length_m: float) -> None:
        graph[i].append((j, length_m))
        graph[j].append((i, length_m))

    for row, length_m in enumerate(np.hypot(*(lines[:, 2:4] - lines[:, :2]).T)):
        join(row, row + len(lines), float(length_m))
    for number, circle in enumerate(circles):
        own = np.flatnonzero(owner == number)
        if len(own) > 1:
            for i, j, length_m in arcs(circle, points[own], discs, boxes):
                join(int(own[i]), int(own[j]), length_m)
    begin, end = set(np.flatnonzero(owner == 0)), set(np.flatnonzero(owner == 1))
    least, queue = {int(node): 0.0 for node in begin}, [(0.0, int(node)) for node in begin]
    while queue:
        length_m, node = heapq.heappop(queue)
        if node in end:
            return length_m
        for other, step_m in graph[node] if length_m <= least[node] else ():
            if length_m + step_m < least.get(other, np.inf):
                least[other] = length_m + step_m
                heapq.heappush(queue, (least[other], other))
    return float("inf")


def arcs(circle: Array, points: Array, discs: Array, boxes: Array) -> list[tuple[int, int, float]]:
    """(i, j, length [m]) of the free arcs between neighbours among (n, 2) points on a circle."""
    x, y, r = circle
    angle = np.arctan2(points[:, 1] - y, points[:, 0] - x)
    order = np.argsort(angle)
    first, second = order, np.roll(order, -1)
    turn = (angle[second] - angle[first]) % (2.0 * np.pi)
    probes = angle[first, None] + turn[:, None] * (np.arange(ARC_PROBES) + 0.5) / ARC_PROBES
    there = np.column_stack((x + r * np.cos(probes).ravel(), y + r * np.sin(probes).ravel()))
    free = ~crossed(there, there, discs, boxes).reshape(probes.shape).any(axis=1)
    return list(zip(first[free].tolist(), second[free].tolist(), (r * turn[free]).tolist(), strict=True))
