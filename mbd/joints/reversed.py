"""A joint seen from its child."""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter
from typing import Any

from mbd.bodies import algebra
from mbd.bodies.algebra import cross, rotate, scaled, transpose
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.dataclass import dataclass
from mbd.joints.base import Joint
from mbd.tape.node import Scalar

__all__ = ["Reversed"]


def _of_joint(name: str) -> Any:
    """What the joint itself has under a name: a value, or a method of it."""
    return property(attrgetter(f"joint.{name}"))


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

    parent = _of_joint("child")
    child = _of_joint("parent")
    name, labels, velocity_labels = _of_joint("name"), _of_joint("labels"), _of_joint("velocity_labels")
    loss, stiffness, rest, anatomy = map(_of_joint, ("loss", "stiffness", "rest", "anatomy"))
    is_planar, is_vector, is_elastic = map(_of_joint, ("is_planar", "is_vector", "is_elastic"))
    orientation, adding, defaults = map(_of_joint, ("orientation", "adding", "defaults"))
    compose, difference, normalise = map(_of_joint, ("compose", "difference", "normalise"))
    coordinate_rates, increment_rates = _of_joint("coordinate_rates"), _of_joint("increment_rates")
    increment_velocities, elastic_energy = _of_joint("increment_velocities"), _of_joint("elastic_energy")
    parameters, domains = _of_joint("parameters"), _of_joint("domains")

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
