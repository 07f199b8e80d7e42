"""A joint seen from its child."""

from collections.abc import Sequence

from mbd.bodies import algebra
from mbd.bodies.algebra import cross, rotate, scaled, transpose
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.dataclass import dataclass, forwarded
from mbd.joints.base import Joint
from mbd.tape.node import Scalar


@dataclass(frozen=True)
class Reversed(Joint):
    """A joint as a tree edge that is walked from its child to its parent; its coordinates keep their meaning.

    With R, p of the joint, ``R' = Rᵀ``, ``p' = −Rᵀ p``; with its velocity (ω, v) in child axes the parent frame moves,
    seen from the child, with ``ω' = −R ω``, ``v' = (R ω) × p − R v`` in parent axes.

    Parameters
    ----------
    joint : the joint as the user described it
    """

    joint: Joint

    is_reversed = True

    parent = forwarded("joint.child")
    child = forwarded("joint.parent")
    name, labels = forwarded("joint.name"), forwarded("joint.labels")
    loss, stiffness, rest, anatomy = map(forwarded, ("joint.loss", "joint.stiffness", "joint.rest", "joint.anatomy"))
    is_planar, is_vector, is_elastic = map(forwarded, ("joint.is_planar", "joint.is_vector", "joint.is_elastic"))
    orientation, adding, defaults = map(forwarded, ("joint.orientation", "joint.adding", "joint.defaults"))
    velocity_labels = forwarded("joint.velocity_labels")
    compose, difference, normalise = map(forwarded, ("joint.compose", "joint.difference", "joint.normalise"))
    coordinate_rates, increment_rates = forwarded("joint.coordinate_rates"), forwarded("joint.increment_rates")
    increment_velocities, elastic_energy = forwarded("joint.increment_velocities"), forwarded("joint.elastic_energy")
    parameters, domains = forwarded("joint.parameters"), forwarded("joint.domains")
    losses, frictions, resistance = map(forwarded, ("joint.losses", "joint.frictions", "joint.resistance"))
    is_isotropic, freedoms = forwarded("joint.is_isotropic"), forwarded("joint.freedoms")
    coordinate_names, velocity_names = forwarded("joint.coordinate_names"), forwarded("joint.velocity_names")
    value_faults, faults, known_as = map(forwarded, ("joint.value_faults", "joint.faults", "joint.known_as"))

    def transform(self, q: Sequence[Scalar], scope: Scope) -> tuple[Rotation, Triple]:
        """The inverse placement."""
        return _inverse(*self.joint.transform(q, scope))

    def subspace(self, q: Sequence[Scalar], scope: Scope) -> Sequence[tuple[Triple, Triple]]:
        """The inverse motion."""
        R, p = self.joint.transform(q, scope)
        result = []
        for angular, linear in self.joint.subspace(q, scope):
            turn = rotate(R, angular)
            result.append((scaled(-1.0, turn), algebra.difference(cross(turn, p), rotate(R, linear))))
        return result

    def rows(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """The joint's rows on the inverse placement."""
        return self.joint.rows(*_inverse(R, p), scope)

    def recover(self, R: Rotation, p: Triple, scope: Scope) -> Sequence[Scalar]:
        """The joint's coordinates of the inverse placement."""
        return self.joint.recover(*_inverse(R, p), scope)


def _inverse(R: Rotation, p: Triple) -> tuple[Rotation, Triple]:
    back = transpose(R)
    return back, scaled(-1.0, rotate(back, p))
