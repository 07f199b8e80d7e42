"""The promise every force makes."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import NamedTuple

from mbd.bodies.base import Frame, frames_in_words
from mbd.bodies.domains import Parameterized
from mbd.bodies.scope import Scope
from mbd.dataclass import dataclass
from mbd.errors import ModelError
from mbd.forces.quantities import Mention
from mbd.joints.base import Joint
from mbd.tape.node import Node, Scalar


@dataclass(frozen=True)
class Action:
    """What a force does to the mechanism.

    Parameters
    ----------
    pairs : (velocity, force) with the virtual power ``Σ force · velocity``; velocities are linear in v, and the
        forces are held fixed when generalized forces are formed
    potential : V, stored energy [J]; ∂V/∂q enters f
    dissipation : D(v) [W]; ∂D/∂v enters f
    rates : (state z, its rate ż) of first-order states of the force
    inertias : (u, J) with the kinetic energy ``½ J u²``: u is the rate of a function of the posture, J a constant
    """

    pairs: tuple[tuple[Scalar, Scalar], ...] = ()
    potential: Scalar | None = None
    dissipation: Scalar | None = None
    rates: tuple[tuple[Node, Scalar], ...] = ()
    inertias: tuple[tuple[Scalar, Scalar], ...] = ()


class Result(NamedTuple):
    """A result of a force: its value, traced as it is asked for, and whether it has the components x, y and z."""

    value: Callable[[Scope], Scalar | Sequence[Scalar]]
    is_vector: bool = False


class Force(Parameterized, ABC):
    """A cause of motion besides joints and constraints; a new force is a frozen dataclass with a `name`.

    `domains` may say what its parameters may be.
    """

    @abstractmethod
    def act(self, scope: Scope) -> Action:
        """Its action, recorded on the tape."""

    @property
    @abstractmethod
    def kind(self) -> str:
        """'potential', 'loss' or 'applied': whether it stores energy, only takes it, or may give it.

        A loss may store energy besides, as springs beside dampers do.
        """

    @property
    def column(self) -> str:
        """Kind of cause in the energy ledger: 'damper' for a loss, 'force' for what is applied, 'potential'."""
        return {"loss": "damper", "applied": "force"}.get(self.kind, self.kind)

    @property
    def is_external(self) -> bool:
        """Whether it acts from outside, so that no joint transmits its reaction; net moments of joints leave it out."""
        return False

    @abstractmethod
    def mentions(self) -> list[Mention]:
        """The frames, joints and named quantities it refers to."""

    @abstractmethod
    def parameters(self) -> dict[str, float]:
        """Run-time parameters by full name."""

    def results(self) -> dict[str, Result]:
        """What runs know of it besides its power and energy, by field: {'force': Result(…)} is 'name.force'."""
        return {}


def frame_of(value: object, what: str) -> Frame:
    """A frame, checked at the border."""
    if not isinstance(value, Frame):
        raise ModelError(
            f"{what} must be a frame such as thigh.end or model.ground.origin, got {value!r}{frames_in_words(value)}"
        )
    return value


def joint_of(value: object, what: str) -> Joint:
    """A joint with one coordinate, checked at the border."""
    if not isinstance(value, Joint):
        raise ModelError(f"{what} must be a joint such as the Revolute it acts on, got {value!r}")
    if len(value.labels) != 1:
        names = ", ".join(repr(name) for name in value.coordinate_names) or "none"
        instead = ""
        if value.orientation is not None:
            instead = (
                "; of a joint that turns freely take mbd.Applied with torque= and axes=, or a mbd.Potential, "
                f"mbd.Bilateral or mbd.Unilateral of an angle such as '{value.name}.euler.zxy.1'"
            )
        elif value.labels:
            instead = (
                "; of one among several take a mbd.Potential, mbd.Bilateral or mbd.Unilateral of it, such as "
                f"{value.coordinate_names[0]!r}, or one joint after another"
            )
        raise ModelError(f"{what} must have one coordinate; '{value.name}' has {names}{instead}")
    return value
