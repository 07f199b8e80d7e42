"""Clusters: coordinates, first-order states and rows that masses, forces or rows connect, however indirectly.

What happens in one of them leaves the others as they are, so whether it is resolved must not depend on these.
"""

from __future__ import annotations

from functools import reduce
from operator import or_

from mbd.equations.equations import Equations
from mbd.tape.derivatives import live
from mbd.tape.node import Node


def clusters(equations: Equations) -> tuple[int, ...]:
    """The number of the cluster of each component of the balance and of each row (n_v + n_z + m), counted from 0.

    Rows that no component enters, which never act, are of the first.
    """
    n = equations.n_v + equations.n_z
    size = n + len(equations.rows)
    geometry = equations.geometry
    if geometry is not None and geometry.largest_tree == equations.n_v:  # its masses connect all
        return (0,) * size
    found = list[int]()
    for group in _connected(equations, n):
        joined = [each for each in found if each & group]
        found = [each for each in found if not each & group] + [reduce(or_, joined, group)]
    numbers: dict[int, int] = {}
    groups = [next(each for each in found if each >> i & 1) for i in range(size)]
    moving = (1 << n) - 1
    return tuple(numbers.setdefault(group, len(numbers)) if group & moving else 0 for group in groups)


def _connected(equations: Equations, n: int) -> list[int]:
    """What one line of the balance, row, contact, friction or held number connects: sets as bits.

    Bits are those of the balance, then of rows, then of anchors.
    """
    at_anchors = n + len(equations.rows)
    places = list(range(equations.n_q))  # of the velocity that goes with each coordinate
    whole = dict[int, int]()  # the velocities of a joint whose coordinates do not add, as bits, by its coordinates
    shift = 0
    for joint, first_q, first_v in equations.configuration.charts:
        count, speeds = len(joint.coordinate_names), len(joint.velocity_names)
        bits = ((1 << speeds) - 1) << first_v
        whole |= dict.fromkeys(range(first_q, first_q + count), bits)
        shift += count - speeds
        for place in range(first_q + count, equations.n_q):
            places[place] = place - shift
    first = {"x": 0, "v": 0, "a": 0, "z": equations.n_v, "s": equations.n_v, "lam": n, "anchor": at_anchors}

    def own(node: Node) -> int:
        kind, k = str(node.data[0]), int(node.data[1])
        if kind == "q":
            return whole.get(k, 1 << places[k])
        return 1 << first[kind] + k if kind in first else 0

    groups: list[tuple[int, list[Node]]] = [(1 << i, [node]) for i, node in enumerate(equations.balance)]
    groups += [(1 << n + k, [row.value, row.rate]) for k, row in enumerate(equations.rows)]
    groups += [(1 << n + friction.row, [friction.limit, friction.rate]) for friction in equations.frictions]
    for contact in equations.contacts:
        force = [] if contact.force is None else [contact.force]
        groups.append((sum(1 << n + row for row in contact.rows), [contact.gap, *contact.generalized, *force]))
        groups += [(1 << at_anchors + k, [node]) for k, node in zip(contact.anchors, contact.captured, strict=True)]
    for machine in equations.machines:
        groups += [(1 << at_anchors + k, [node]) for k, node in zip(machine.anchors, machine.captured, strict=True)]
    masks = dict[int, int]()
    for node in live(node for _, nodes in groups for node in nodes):
        mask = own(node) if node.op == "input" else 0
        for each in node.args:
            mask |= masks[each.index]
        masks[node.index] = mask
    return [reduce(or_, (masks[node.index] for node in nodes), bits) for bits, nodes in groups]
