"""The mechanism as a graph: bodies are nodes, joints are edges. Questions only, no mechanics."""

from collections.abc import Collection, Sequence
from typing import Any

from mbd.joints.base import Joint
from mbd.topology.description import Description

Links = dict[str, dict[str, dict[str, Joint]]]
"""The joints by name between a body and each of its neighbors, by their names: the adjacency of the graph."""


def links_of(model: Description, without: Collection[str] = ()) -> Links:
    """Who is connected to whom, in order of connection, in plain words: every model is asked this at its start.

    Parameters
    ----------
    model : a model
    without : names of joints to leave out
    """
    links: Links = {name: {} for name in model.bodies}
    for joint in model.joints:
        if joint.name not in without:
            parent, child = joint.parent.body.name, joint.child.body.name
            between = links.setdefault(parent, {}).setdefault(child, {})
            links.setdefault(child, {})[parent] = between
            between[joint.name] = joint
    return links


def graph_of(model: Description, without: Collection[str] = ()) -> Any:
    """The same as a `networkx.MultiGraph` of body names, for questions of one's own; edges carry their `joint`."""
    import networkx as nx  # takes longer to load than a walker takes to derive

    graph: Any = nx.MultiGraph(name=model.name)
    links = links_of(model, without)
    graph.add_nodes_from(links)
    for joint in model.joints:
        if joint.name not in without:
            graph.add_edge(joint.parent.body.name, joint.child.body.name, key=joint.name, joint=joint)
    return graph


def disconnected(model: Description) -> list[str]:
    """Names of the bodies without a chain of joints to the ground."""
    links = links_of(model)
    _, _, reached = spanning_tree(links, model.ground.name)
    return [name for name in links if name not in reached]


def spanning_tree(links: Links, root: str) -> tuple[list[Joint], list[Joint], list[str]]:
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
        for other, joints in links[body].items():
            if other not in reached:
                reached[other] = None
                queue.append(other)
                name, joint = next(iter(joints.items()))
                tree[name] = joint
    closing: dict[str, Joint] = {}
    for body in queue:
        for joints in links[body].values():
            closing |= {name: joint for name, joint in joints.items() if name not in tree and name not in closing}
    return list(tree.values()), list(closing.values()), queue


def mobility(bodies: int, joints: Sequence[Joint], planar: bool) -> int:
    """Grübler's count ``d n − Σ (d − f_j)``, d = 3 in the plane and 6 in space.

    The degrees of freedom where the constraints are independent; redundant loops have more.

    Parameters
    ----------
    bodies : n, without the ground
    joints : with f_j velocities each
    planar : whether all moves in x–y
    """
    d = 3 if planar else 6
    return d * bodies - sum(d - len(joint.freedoms) for joint in joints)
