"""Where closing begins, whatever joints are cut: the start that the model has with only its loops cut."""

from collections.abc import Callable, Sequence

import numpy as np

from mbd.arrays import Vector
from mbd.assembly.pose import Posture
from mbd.compile.mechanism import Mechanism
from mbd.compile.python import ScalarFunction, scalar_function
from mbd.dataclass import dataclass
from mbd.equations.derivation import TreeGeometry, derive
from mbd.errors import MbdError
from mbd.tape.node import Node, Scalar
from mbd.topology.description import Description
from mbd.topology.plan import plan, uncut

Values = dict[str, float]
"""Values of coordinates or of their velocities, by name."""


@dataclass(frozen=True)
class _Whole:
    """The mechanism with only its loops cut, and the coordinates and velocities that there are with others cut, too.

    names : of both; function : their values by the coordinates of the whole
    """

    mechanism: Mechanism
    names: Sequence[str]
    function: ScalarFunction


def opening(
    model: object, mechanism: Mechanism, parameters: Vector, close: Callable[[Mechanism, Vector], Posture]
) -> Values:
    """Values of coordinates and velocities in the start without the cuts that the model asks for; none without such.

    What rows move, and how far, follows from the coordinates that they move: with a joint cut a drive of the shoulder
    would leave the forearm in its direction, not at its angle. So the start is closed in the tree that cuts nothing but
    loops, and closing begins there.

    Parameters
    ----------
    parameters : values of the run-time parameters
    close : the named values in a mechanism with these values of its parameters, closed if they can be
    """
    if not isinstance(model, Description):
        return {}
    whole = mechanism.kept(opening, lambda: _whole(model, mechanism))
    if whole is None:
        return {}
    known = dict(zip((each.name for each in mechanism.equations.parameters), parameters.tolist(), strict=False))
    own = whole.mechanism.equations.parameters
    values = whole.mechanism.parameters({each.name: known[each.name] for each in own if each.name in known})
    try:
        work, found = close(whole.mechanism, values), np.zeros(len(whole.names))
    except MbdError:  # the mechanism as it is cut says why
        return {}
    block = whole.mechanism.block(work.time, work.q, work.y, work.anchors)
    whole.function(block, work.parameters, found)
    return dict(zip(whole.names, found.tolist(), strict=True))


def _whole(model: Description, mechanism: Mechanism) -> _Whole | None:
    """None where nothing but loops is cut, or the model cannot be derived so."""
    here, chosen = plan(model), uncut(model, with_reactions=True)
    apart = {joint.name for joint in (*here.floating, *chosen.cut)}
    if apart.isdisjoint(joint.name for joint in here.edges):
        return None
    known = model.parameters
    tunable = [each.name for each in mechanism.equations.parameters if each.name in known]
    try:
        equations = derive(model.with_tunable(*tunable), chosen)
    except MbdError:
        return None
    assert isinstance(equations.geometry, TreeGeometry)
    scope, names, nodes = equations.geometry.scope, list[str](), list[Node]()
    for joint in here.edges:
        if joint.name in apart:
            seen = scope.read(joint)
            found: Sequence[Scalar] = (*seen, *scope.velocities(joint, seen))
        else:
            motion = scope.joint(joint.name)
            found = (*motion.coordinates, *motion.rates)
        names += (*joint.coordinate_names, *joint.velocity_names)
        nodes += [scope.real(value) for value in found]
    made = Mechanism(equations, "python")
    return _Whole(made, names, scalar_function(nodes, made.layout, "opening"))
