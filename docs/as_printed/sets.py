"""Eq. 2 to 5 and the numbering of section 5.1.1 as printed; as flown: `onboard.planning.local.poses.node_sets`."""

from __future__ import annotations

from collections.abc import Set


def node_numbers(nodes: int) -> range:
    """The i of n_i: "takes values from 0 to N, where N is equal to the total number of nodes"."""
    return range(0, nodes + 1)


def eq_2_to_5_hold(workspace: Set[int], free: Set[int], obs: Set[int], occ: Set[int]) -> bool:
    """True if three sets of nodes satisfy Eq. 2 to 5, which define each of them by the other two."""
    return (
        free == workspace - obs - occ  # 2
        and obs == workspace - free - occ  # 3
        and occ == workspace - free - obs  # 4
        and workspace == free | obs | occ  # 5
    )
