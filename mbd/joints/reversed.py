"""A joint seen from its child."""

from __future__ import annotations

from collections.abc import Sequence

from mbd.bodies.algebra import cross, difference, rotate, scaled, transpose
from mbd.bodies.base import Frame
from mbd.bodies.domains import Domain
from mbd.bodies.scope import Rotation, Scope, Triple
from mbd.dataclass import dataclass
from mbd.joints.base import Joint, JointLoss, Label
from mbd.tape.node import Scalar

__all__ = ["Reversed"]


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

    @property
    def name(self) -> str:  # type: ignore[override]
        """The name of the joint."""
        return self.joint.name

    @property
    def parent(self) -> Frame:  # type: ignore[override]
        """The joint's child frame."""
        return self.joint.child

    @property
    def child(self) -> Frame:  # type: ignore[override]
        """The joint's parent frame."""
        return self.joint.parent

    @property
    def loss(self) -> JointLoss:  # type: ignore[override]
        """The joint's loss."""
        return self.joint.loss

    @property
    def stiffness(self) -> float:  # type: ignore[override]
        """The joint's stiffness."""
        return self.joint.stiffness

    @property
    def rest(self) -> float:  # type: ignore[override]
        """The joint's rest."""
        return self.joint.rest

    @property
    def anatomy(self) -> str:  # type: ignore[override]
        """As the joint."""
        return self.joint.anatomy

    @property
    def labels(self) -> tuple[Label, ...]:
        """The joint's coordinates."""
        return self.joint.labels

    @property
    def is_planar(self) -> bool:
        """As the joint."""
        return self.joint.is_planar

    @property
    def is_vector(self) -> bool:
        """As the joint."""
        return self.joint.is_vector

    @property
    def orientation(self) -> int | None:
        """As the joint."""
        return self.joint.orientation

    @property
    def is_elastic(self) -> bool:
        """As the joint."""
        return self.joint.is_elastic

    def elastic_energy(self, q: Sequence[Scalar], scope: Scope) -> Scalar:
        """As the joint."""
        return self.joint.elastic_energy(q, scope)

    @property
    def adding(self) -> int:
        """As the joint."""
        return self.joint.adding

    def compose(self, q: Sequence[Scalar], x: Sequence[Scalar]) -> Sequence[Scalar]:
        """As the joint."""
        return self.joint.compose(q, x)

    @property
    def velocity_labels(self) -> tuple[Label, ...]:
        """The joint's velocities."""
        return self.joint.velocity_labels

    @property
    def defaults(self) -> tuple[float, ...]:
        """As the joint."""
        return self.joint.defaults

    def difference(self, q: Sequence[Scalar], other: Sequence[Scalar]) -> Sequence[Scalar]:
        """As the joint."""
        return self.joint.difference(q, other)

    def normalise(self, q: Sequence[Scalar]) -> Sequence[Scalar]:
        """As the joint."""
        return self.joint.normalise(q)

    def coordinate_rates(self, q: Sequence[Scalar], v: Sequence[Scalar]) -> Sequence[Scalar]:
        """As the joint."""
        return self.joint.coordinate_rates(q, v)

    def increment_rates(self, x: Sequence[Scalar], v: Sequence[Scalar]) -> Sequence[Scalar]:
        """As the joint."""
        return self.joint.increment_rates(x, v)

    def increment_velocities(self, x: Sequence[Scalar], rates: Sequence[Scalar]) -> Sequence[Scalar]:
        """As the joint."""
        return self.joint.increment_velocities(x, rates)

    def parameters(self) -> dict[str, float]:
        """As the joint."""
        return self.joint.parameters()

    def domains(self) -> dict[str, Domain]:
        """As the joint."""
        return self.joint.domains()

    def transform(self, q: Sequence[Scalar], scope: Scope) -> tuple[Rotation, Triple]:
        """The inverse placement."""
        return _inverse(*self.joint.transform(q, scope))

    def subspace(self, q: Sequence[Scalar], scope: Scope) -> Sequence[tuple[Triple, Triple]]:
        """The inverse motion."""
        R, p = self.joint.transform(q, scope)
        result = []
        for angular, linear in self.joint.subspace(q, scope):
            turn = rotate(R, angular)
            result.append((scaled(-1.0, turn), difference(cross(turn, p), rotate(R, linear))))
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
