"""A linear motion with its rows beside it: all coordinates, accelerations and multipliers, nothing eliminated."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from mbd.analysis.independent import row_sizes
from mbd.analysis.instant import Instant
from mbd.analysis.linear_motion import Prescribed, multiplier_map
from mbd.arrays import ComplexArray, Matrix
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL
from mbd.equations.linearization import LinearTerms
from mbd.equations.ports import PortTerms
from mbd.errors import ModelError


@dataclass(frozen=True, eq=False)
class DescriptorForm:
    """``E ξ̇ = A ξ + B δu``, ``δy = C ξ + D δu`` with singular E: rows are held as they stand.

    ξ are the changes of all places, velocities and first-order states, their rates, the multipliers of the rows that
    are independent of each other, and what inputs prescribe. The pencil ``s E − A`` is regular; with rows on positions
    its index is 3.

    Attributes
    ----------
    E, A : (n, n); B : (n, k); C : (o, n); D : (o, k)
    variables, inputs, outputs : their names
    """

    E: Matrix
    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    variables: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]

    def transfer(self, s: Any) -> ComplexArray:
        """``C (s E − A)⁻¹ B + D`` at complex numbers s [1/s]; (…, o, k) for s of shape (…)."""
        points = np.asarray(s, dtype=complex)[..., None, None]
        try:
            inside = np.linalg.solve(points * self.E - self.A, self.B.astype(complex))
        except np.linalg.LinAlgError:
            raise ModelError("the transfer function is infinite at one of these points, which is a pole") from None
        return (self.C @ inside + self.D).astype(complex)

    def __repr__(self) -> str:
        size = f"{len(self.variables)} variables, {len(self.inputs)} inputs, {len(self.outputs)} outputs"
        return f"descriptor form with {size}\n  variables: {', '.join(self.variables)}"


def descriptor_form(
    found: Instant,
    terms: LinearTerms,
    ports: PortTerms,
    given: Prescribed,
    names: Sequence[str],
    ends: tuple[Sequence[str], Sequence[str]],
) -> DescriptorForm:
    """The matrices at an instant.

    Parameters
    ----------
    names : of places, velocities and first-order states
    ends : names of inputs and of outputs

    Raises
    ------
    ModelError
        where rows turn as the state moves, so that no constant matrices hold them.
    """
    _require_standing(found, terms)
    n_v, n, s = terms.K.shape[1], len(terms.r), len(given.states)
    kept, fast = found.kept, found.kept(found.velocity)[:, None]
    m, k = len(fast), given.input_force.shape[1]
    velocities = np.hstack([np.eye(n_v), np.zeros((n_v, n - n_v))])
    rows = np.hstack([kept(terms.B), np.zeros((m, n - n_v))])
    A = np.block([
        [terms.carried, velocities, np.zeros((n_v, n + m + s))],
        [np.zeros((n, n_v + n)), np.eye(n), np.zeros((n, m + s))],
        [-terms.K, -terms.C, -terms.M, -found.forces(terms), -given.force],
        [np.where(fast, kept(terms.turning), kept(terms.B)), np.where(fast, rows, 0.0), np.zeros((m, n + m)),
         np.where(fast, kept(given.speed), kept(given.place))],
        [np.zeros((s, n_v + 2 * n + m)), given.rates[0]],
    ])  # fmt: skip
    B = np.vstack([np.zeros((n_v + n, k)), -given.input_force, np.zeros((m, k)), given.rates[1]])
    E = block_diag(np.eye(n_v + n), np.zeros((n + m, n + m)), np.eye(s))
    seen = ports.place, ports.speed, ports.state, ports.acceleration, ports.state_rate
    C = np.hstack([*seen, ports.multiplier @ multiplier_map(found), given.through[0]])
    held = [title for title, follows in zip(found.titles, found.dependent, strict=True) if not follows]
    rates = [f"d/dt {name}" for name in names[n_v:]]
    variables = (*names, *rates, *(f"multiplier of {title}" for title in held), *given.names)
    return DescriptorForm(E, A, B, C, given.through[1], variables, tuple(ends[0]), tuple(ends[1]))


def _require_standing(found: Instant, terms: LinearTerms) -> None:
    """Rows with constant derivatives: ``d/dt (B δx) = B δẋ`` is all of δḣ, and its rate all of δḧ."""
    B, carried = terms.B, terms.carried
    first = np.where(found.velocity[:, None], 0.0, terms.turning - B @ carried)
    second = np.hstack([terms.change_speed - terms.turning, terms.change_place - terms.turning @ carried])
    size = row_sizes(np.hstack([B, terms.turning]))[:, None]
    turning = np.max(np.abs(np.hstack([first, second]) / size), axis=1, initial=0.0) > EQUAL_RTOL
    if np.any(turning):
        titles = ", ".join(title for title, turns in zip(found.titles, turning, strict=True) if turns)
        raise ModelError(
            f"rows turn as this state moves ({titles}), so that no constant matrices hold them; give an equilibrium, "
            "or take A, B, C and D, which hold at any state"
        )
