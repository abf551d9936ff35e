"""Slow plain twins of the global planner: a plane fitted at each node, edges in whole arrays, a heap Dijkstra."""

from __future__ import annotations

import heapq

import numpy as np

from onboard.config import Planning

NEIGHBOURS = ((0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1))


def window(z: np.ndarray, j: int, i: int) -> np.ndarray:
    """(3, 3) heights above node (j, i): straight on beyond the border, a missing one mirrored from the one opposite."""
    around = np.pad(z, 1, mode="reflect", reflect_type="odd")[j : j + 3, i : i + 3] - z[j, i]
    mirrored = np.where(np.isnan(around), -around[::-1, ::-1], around)
    return np.where(np.isnan(mirrored), 0.0, mirrored)


def layers(z: np.ndarray, cell_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Roughness about the least-squares plane, raw roughness, slope_x, slope_y, node by node."""
    z = np.where(np.isfinite(z), z.astype(np.float64), np.nan)
    out = np.full((4, *z.shape), np.nan)
    v, u = np.mgrid[-1:2, -1:2] * cell_m
    matrix = np.column_stack([u.ravel(), v.ravel(), np.ones(9)])
    for j, i in np.argwhere(np.isfinite(z)):
        heights = window(z, j, i).ravel()
        fit = np.linalg.lstsq(matrix, heights, rcond=None)[0]
        out[:, j, i] = np.std(heights - matrix @ fit), np.std(heights), fit[0], fit[1]
    return out[0], out[1], out[2], out[3]


def edge_costs(z: np.ndarray, cell_m: float, planning: Planning, floor_m: float) -> np.ndarray:
    """Cost of leaving each node towards each neighbour (8, rows, columns), edge by edge (Eq. 25)."""
    rough, _, slope_x, slope_y = layers(z, cell_m)
    largest, limit = max(float(np.nanmax(rough, initial=0.0)), floor_m), planning.slope_limit_rad
    costs = np.full((8, *z.shape), np.inf)

    def price(j: int, i: int, heading: np.ndarray) -> float:
        gradient = np.array([slope_x[j, i], slope_y[j, i]])
        pitch, roll = (abs(np.arctan(gradient @ axis)) for axis in (heading, (-heading[1], heading[0])))
        if not (pitch <= limit and roll <= limit):
            return np.inf
        tilts = planning.weight_roll * roll / limit + planning.weight_pitch * pitch / limit
        return float((planning.weight_roughness * rough[j, i] / largest + tilts) / planning.weight_length)

    for k, (dj, di) in enumerate(NEIGHBOURS):
        heading = np.array([di, dj]) / np.hypot(di, dj)
        for j, i in np.argwhere(np.isfinite(z)):
            b, a = j + dj, i + di
            if 0 <= b < z.shape[0] and 0 <= a < z.shape[1] and np.isfinite(z[b, a]):
                length = np.hypot(cell_m * np.hypot(dj, di), float(z[b, a]) - float(z[j, i]))
                costs[k, j, i] = length * (1 + 0.5 * (price(j, i, heading) + price(b, a, heading)))
    return costs


def cost_to_go(costs: np.ndarray, seeds: dict[tuple[int, int], float]) -> np.ndarray:
    """Least cost from every node to a seed over directed edges, by a heap."""
    far = np.full(costs.shape[1:], np.inf)
    heap = [(left, node) for node, left in seeds.items()]
    heapq.heapify(heap)
    while heap:
        cost, (j, i) = heapq.heappop(heap)
        if cost >= far[j, i]:
            continue
        far[j, i] = cost
        for k, (dj, di) in enumerate(NEIGHBOURS):
            b, a = j - dj, i - di  # a node from which direction k leads here
            if 0 <= b < far.shape[0] and 0 <= a < far.shape[1] and cost + costs[k, b, a] < far[b, a]:
                heapq.heappush(heap, (cost + costs[k, b, a], (b, a)))
    return far
