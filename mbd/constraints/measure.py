"""The promise of measures: where."""

from abc import ABC, abstractmethod
from collections.abc import Sequence

from mbd.bodies.base import Frame
from mbd.bodies.domains import Domain
from mbd.bodies.promises import scalar
from mbd.bodies.scope import Scope
from mbd.forces.quantities import Mention
from mbd.tape.node import Scalar


class Measure(ABC):
    """Where: a signed distance or angle g of the posture, with ``g ≥ 0`` open where it serves a contact.

    A new measure is a frozen dataclass; it knows the geometry and nothing of laws or of when they act.
    """

    @abstractmethod
    def gap(self, scope: Scope) -> Scalar:
        """g [unit], scaled so that ``|∇g| = 1`` at contact where it is a distance."""

    @property
    @abstractmethod
    def unit(self) -> str:
        """'m' or 'rad'."""

    @abstractmethod
    def mentions(self) -> list[Mention]:
        """The frames, joints and named quantities it refers to."""

    def captured(self, scope: Scope) -> Sequence[Scalar]:
        """Quantities whose values are held from the instant of closing, the anchors; by default none."""
        return ()

    def tangents(self, scope: Scope, anchors: Sequence[Scalar]) -> Sequence[tuple[str, Scalar]]:
        """(part, residual) of the rows that hold a sticking contact; zero at the anchors. None without a tangent.

        Parameters
        ----------
        anchors : one for each of `captured`
        """
        return ()

    @property
    def has_tangents(self) -> bool:
        """Whether it can stick."""
        return False

    def slip_velocities(self, scope: Scope) -> Sequence[tuple[str, Scalar]]:
        """(part, velocity [m/s]) along which a contact slides that no posture tells, as of a ball. None without one."""
        return ()

    @property
    def has_slip_velocities(self) -> bool:
        """Whether `slip_velocities` gives any."""
        return False

    def spin(self, scope: Scope) -> Scalar:
        """Angular velocity about the normal of what touches against what it touches [rad/s], where it `has_spin`."""
        raise NotImplementedError(f"{type(self).__name__} has no spin")

    @property
    def has_spin(self) -> bool:
        """Whether `spin` gives any."""
        return False

    @property
    def title(self) -> str:
        """What it measures, in a word: 'distance'."""
        return type(self).__name__.lower()

    @property
    def reaction(self) -> str:
        """What a multiplier is called in results: 'force', 'tension', or 'drive' of a joint (its force or torque)."""
        return "force"

    @property
    def details(self) -> str:
        """What it measures of what, for a page of text."""
        return f"{self.title} of " + mentioned_names(self.mentions())

    @property
    def undefined(self) -> str:
        """What it means where g is no number, for errors; '' where it always is one."""
        return ""

    def faults(self, owner: str) -> list[str]:
        """What is geometrically impossible about it, one sentence each."""
        return []

    def parameters(self) -> dict[str, float]:
        """Its run-time parameters by full name; its constraint declares them."""
        return {}

    def domains(self) -> dict[str, Domain]:
        """What they may be."""
        return {}

    def refuse(self, scope: Scope) -> None:
        """Raise a `CapabilityError` where it does not serve the motion of its frames; asked by the equations."""
        return


def gap_of(measure: Measure, scope: Scope) -> Scalar:
    """g of a measure, which may be of a user's class.

    Raises
    ------
    ModelError
        where its `gap` raises, or gives no number.
    CapabilityError
        where it does not serve the motion of its frames.
    """
    measure.refuse(scope)
    return scalar(measure, "gap", "gap(scope)", scope)


def mentioned_names(mentions: Sequence[Mention]) -> str:
    """Frames, joints and quantities by name."""
    names = [m if isinstance(m, str) else m.full_name if isinstance(m, Frame) else m.name for m in mentions]
    return ", ".join(f"'{name}'" for name in names)
