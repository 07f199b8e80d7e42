"""The mechanism as a graph: bodies are nodes, joints are edges. Questions only, no mechanics."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Any

from mbd.joints.base import Joint

if TYPE_CHECKING:
    from mbd.model import Model

__all__ = ["disconnected", "graph_of", "mobility", "spanning_tree"]


def graph_of(model: Model, without: Collection[str] = ()) -> Any:
    """A `networkx.MultiGraph` of body names, in order of connection; edges carry their `joint`.

    Parameters
    ----------
    model : a model
    without : names of joints to leave out
    """
    import networkx as nx

    graph: Any = nx.MultiGraph(name=model.name)
    graph.add_nodes_from(model.bodies)
    for joint in model.joints:
        if joint.name not in without:
            graph.add_edge(joint.parent.body.name, joint.child.body.name, key=joint.name, joint=joint)
    return graph


def disconnected(model: Model) -> list[str]:
    """Names of the bodies without a chain of joints to the ground."""
    import networkx as nx

    graph = graph_of(model)
    reached = nx.node_connected_component(graph, model.ground.name)
    return [name for name in graph if name not in reached]


def spanning_tree(graph: Any, root: str) -> tuple[list[Joint], list[Joint], list[str]]:
    """Breadth first from the root, in order of connection.

    Returns
    -------
    tree : joints that lead to a new body, each after the joint that leads to its nearer body
    closing : joints that close a loop
    reached : names of the bodies reached, the root first
    """
    reached, tree = {root: None}, {}
    queue = [root]
    for body in queue:
        for _, other, joint in graph.edges(body, data="joint"):
            if other not in reached:
                reached[other] = None
                queue.append(other)
                tree[joint.name] = joint
    closing = [joint for *_, joint in graph.edges(queue, data="joint") if joint.name not in tree]
    return list(tree.values()), closing, queue


def mobility(bodies: int, joints: Sequence[Joint], planar: bool) -> int:
    """Grübler's count ``d n − Σ (d − f_j)``, d = 3 in the plane and 6 in space.

    The degrees of freedom where the constraints are independent; redundant loops have more.

    Parameters
    ----------
    bodies : n, without the ground
    joints : with f_j coordinates each
    planar : whether all moves in x–y
    """
    d = 3 if planar else 6
    return d * bodies - sum(d - len(joint.labels) for joint in joints)
