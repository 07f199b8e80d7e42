"""The mass matrix and the forces of motion and weight, as arguments of laws: computed torque."""

from collections.abc import Sequence
from typing import Any

from mbd.bodies.scope import Scope
from mbd.bodies.values import names_of
from mbd.dataclass import dataclass
from mbd.errors import ModelError


@dataclass(frozen=True)
class InertialArgument:
    """What `mass_matrix` and `bias_forces` give: it stands for numbers where laws are traced.

    coordinates : names of joints or coordinates; is_matrix : whether it is M, else h
    """

    coordinates: tuple[str, ...]
    is_matrix: bool

    @property
    def label(self) -> str:
        """'mass matrix' or 'bias forces'."""
        return "mass matrix" if self.is_matrix else "bias forces"

    def at(self, scope: Scope) -> Sequence[Any]:
        """M, line by line, or h, on the tape."""
        M, h = scope.inertia(self.coordinates)
        found: Sequence[Any] = tuple(tuple(line) for line in M) if self.is_matrix else tuple(h)
        return found


def mass_matrix(*coordinates: str) -> InertialArgument:
    """M(q) of some coordinates, as an argument of a law: ``M q̈ + h = τ``.

    ``mbd.Motor("drive", hip, torque=f, arguments=[mbd.mass_matrix("hip", "knee"), …])`` calls f with the rows of M,
    ``M[0][1]`` couples the two. The other coordinates are as if they were held.

    Parameters
    ----------
    coordinates : names of joints with one coordinate ('hip'), or of coordinates ('trunk.x'), of the tree

    Examples
    --------
    >>> mass_matrix("hip", "knee").label
    'mass matrix'
    """
    return InertialArgument(_named(coordinates, "mass_matrix"), True)


def bias_forces(*coordinates: str) -> InertialArgument:
    """h(q, v) of some coordinates, the forces of motion and weight of all bodies: ``M q̈ + h = τ``.

    With ``τ = M u + h`` the coordinates obey ``q̈ = u`` (computed torque). Losses and springs are not part of it.

    Parameters
    ----------
    coordinates : as of `mass_matrix`
    """
    return InertialArgument(_named(coordinates, "bias_forces"), False)


def _named(coordinates: Sequence[str], what: str) -> tuple[str, ...]:
    names = names_of(coordinates, f"coordinates of {what}")
    if not names:
        raise ModelError(f"{what} needs names of coordinates, such as {what}('hip', 'knee')")
    return names
