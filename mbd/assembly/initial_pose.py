"""Where closing begins, whatever joints are cut: the pose that the model has with only its loops cut."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mbd.arrays import Vector
from mbd.compile.mechanism import Mechanism
from mbd.equations.derivation_context import DerivationContext
from mbd.tape.evaluate import evaluate
from mbd.tape.node import Node
from mbd.topology.description import Description
from mbd.topology.plan import plan, uncut

__all__ = ["opening"]


def opening(model: Any, mechanism: Mechanism, parameters: Vector, position: Mapping[str, float]) -> dict[str, float]:
    """Values of coordinates that exist only because joints are cut, in the pose that has the named values.

    The named values are put into the tree that cuts nothing but loops, with zeros elsewhere. The places of the bodies
    there are those from which closing begins, so that a start does not depend on the choice of cuts.

    Parameters
    ----------
    parameters : values of the run-time parameters
    position : the named positions
    """
    if not isinstance(model, Description):
        return {}
    made = mechanism.kept(_cut_coordinates, lambda: _cut_coordinates(model))
    names, nodes, coordinates, defaults, inputs = made
    if not names:
        return {}
    given: dict[Node | tuple[str, int], float] = {("t", 0): 0.0}
    for k, (name, default) in enumerate(zip(coordinates, defaults, strict=True)):
        given["q", k], given["x", k] = float(position.get(name, default)), 0.0
    values = dict(zip((each.name for each in mechanism.equations.parameters), parameters, strict=False))
    for k, parameter in enumerate(inputs):
        given["p", k] = float(values.get(parameter.name, parameter.value))
    return dict(zip(names, evaluate(nodes, given), strict=True))


def _cut_coordinates(model: Description) -> tuple[list[str], list[Node], list[str], Sequence[float], Any]:
    """(names of coordinates, their values on a tape, names of its coordinates, their defaults, its parameters)."""
    here, whole = plan(model), uncut(model)
    apart = {joint.name for joint in (*here.floating, *whole.cut)}
    moved = [joint for joint in here.edges if joint.name in apart]
    if not moved:
        return [], [], [], (), ()
    scope = DerivationContext(model.ground, whole.edges, whole.cut, model.gravity, model.tunable, whole.planar)
    names, nodes = list[str](), list[Node]()
    for joint in moved:
        names += joint.coordinate_names
        nodes += [scope.real(value) for value in joint.recover(*scope.relative(joint), scope)]
    return names, nodes, list(whole.coordinate_names), scope.configuration.defaults, scope.parameters.found
