"""Small motions about a state: M, C, K, the state matrix on independent coordinates, natural modes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from mbd.analysis.independent import Independent, independent, row_sizes
from mbd.analysis.instant import Instant, instant
from mbd.arrays import Matrix, Vector
from mbd.assembly.dependence import NEGLIGIBLE
from mbd.configuration import Configuration
from mbd.equations.linearization import LinearTerms
from mbd.errors import ModelError
from mbd.state import State

__all__ = ["Linearization", "NaturalMode", "linearize"]

VANISHES = 1e-6
"""Part of a second derivative along the free motions, relative, below which dependent rows agree nearby too [-]."""
STEADY = 1e-6
"""Acceleration, relative to what a unit displacement and the present speeds would cause, that counts as none [-]."""


@dataclass(frozen=True)
class NaturalMode:
    """One motion ``shape · exp(s t)``; of a conjugate pair the eigenvalue with the positive imaginary part.

    eigenvalue : s = −ζ ω ± i ω √(1−ζ²) [1/s]
    frequency : ω = |s| [rad/s]; hertz : ω/2π [Hz]
    damping_ratio : ζ = −Re s/|s|, 1 for a decay without oscillation, below 0 for a growing motion, NaN for s = 0
    shape : by coordinate, the largest part 1; complex where coordinates move out of phase [m, rad]
    """

    eigenvalue: complex
    frequency: float
    hertz: float
    damping_ratio: float
    shape: Mapping[str, complex]


@dataclass(frozen=True, eq=False)
class Linearization:
    """The linear motion about a state: ``M δv̇ + C δv + K δq + Bᵀ δλ = 0``, reduced to ``δẋ = A δx``.

    Attributes
    ----------
    model : its name; time : of the state [s]
    coordinates : n_v names of the coordinates, in the order of M, C, K and the columns of B; those of velocities for
        joints whose coordinates do not add, with small displacements along these in axes that move with the child
    rows : m titles of the active rows
    M, C, K : (n_v, n_v) derivatives of the balance r by v̇, v and q, with the accelerations and multipliers of the
        state held: K has the geometric stiffness of multipliers, C gyroscopic terms; unsymmetric where forces are
    B : (m, n_v) ∂h/∂q of the rows; of rows on velocities ∂ḣ/∂v
    A : (N, N) state matrix; states : its N names: independent coordinates, independent rates, first-order states
    basis : (2 n_v + n_z, N) small changes of (q, v, z) for a unit change of each of `states`
    y : (n_q + n_v + n_z,) the state (q, v, z); drift : (2 n_v + n_z,) the rates of displacements, v and z: (v, v̇, ż)
    eigenvalues : (N,) of A by growing magnitude, conjugate pairs side by side [1/s]
    shapes : (n_v, N) the coordinates' part of each motion, largest part 1; of motions that move no coordinate 0
    """

    model: str
    time: float
    coordinates: tuple[str, ...]
    rows: tuple[str, ...]
    states: tuple[str, ...]
    M: Matrix
    C: Matrix
    K: Matrix
    B: Matrix
    A: Matrix
    basis: Matrix
    y: Vector
    drift: Vector
    eigenvalues: Any
    shapes: Any
    picked: tuple[int, ...] = field(repr=False)
    instant: Instant = field(repr=False)

    @property
    def frequencies(self) -> Vector:
        """(N,) ω = |s| [rad/s]."""
        return np.asarray(np.abs(self.eigenvalues))

    @property
    def hertz(self) -> Vector:
        """(N,) ω/2π [Hz]."""
        return self.frequencies / (2.0 * np.pi)

    @property
    def damping_ratios(self) -> Vector:
        """(N,) ζ = −Re s/|s|; NaN for s = 0."""
        with np.errstate(all="ignore"):
            return np.asarray(-self.eigenvalues.real / np.abs(self.eigenvalues))

    @property
    def modes(self) -> tuple[NaturalMode, ...]:
        """The motions by growing frequency, each conjugate pair once."""
        return tuple(
            NaturalMode(
                complex(s), float(self.frequencies[k]), float(self.hertz[k]), float(self.damping_ratios[k]),
                dict(zip(self.coordinates, self.shapes[:, k].tolist(), strict=True)),
            )
            for k, s in enumerate(self.eigenvalues) if s.imag >= 0.0
        )  # fmt: skip

    @property
    def x(self) -> Vector:
        """(N,) values of `states` [m, rad, m/s, rad/s, …]."""
        configuration = self._configuration
        if configuration.is_vector:
            return self.y[list(self.picked)]
        places = np.append(self.y, 0.0)[configuration.places]  # increments of charts are 0 here
        return np.append(places, self.y[configuration.n_q :])[list(self.picked)]

    @property
    def _configuration(self) -> Configuration:
        return self.instant.mechanism.equations.configuration

    @property
    def is_equilibrium(self) -> bool:
        """Whether no independent rate changes; the rates themselves may be steady, as those of a governor."""
        n_v, rates = len(self.coordinates), [k for k, place in enumerate(self.picked) if place >= len(self.coordinates)]
        caused = np.abs(self.A[rates]) @ (np.abs(self.x) + [float(place < n_v) for place in self.picked])
        return bool(np.all(np.abs(self.drift[list(self.picked)][rates]) <= STEADY * np.maximum(caused, 1e-3)))

    def rhs(self, t: float, y: Vector) -> Vector:
        """``ẏ`` of the nonlinear motion, y = (q, v, z), with the contacts of the state: for `solve_ivp`.

        Accelerations satisfy ``[M Bᵀ; B 0] (v̇, λ) = −(f, γ)``. Nothing switches, and rows are held in their
        accelerations only: h grows with the error of the integrator.
        """
        system, n, configuration = self.instant.system, len(self.coordinates), self._configuration
        q, speeds = np.split(np.asarray(y, dtype=float), [configuration.n_q])
        rate, _ = system.accelerations(float(t), q, speeds, self.instant.state.mode)
        return np.concatenate([configuration.rates(q, speeds[:n]), rate])

    def linear_rhs(self, t: float, x: Vector) -> Vector:
        """``ẋ = ẋ₀ + A (x − x₀)`` of the independent states, x₀ = `x`: for `solve_ivp`."""
        change = np.asarray(x, dtype=float) - self.x
        return np.asarray(self.drift[list(self.picked)] + self.A @ change)

    def plot_modes(self, path: str | Path | None = None, most: int = 6) -> Any:
        """Mode shapes as bars, one panel for each of the `most` slowest motions that move a coordinate; the figure."""
        from mbd.view.modes import modes

        return modes(self, path, most)

    def __str__(self) -> str:
        from mbd.analysis.tables import linear_table

        return linear_table(self)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        from mbd.analysis.tables import linear_html

        return linear_html(self)


def linearize(
    model: Any, state: State, parameters: Mapping[str, float] | None = None, backend: str = "auto"
) -> Linearization:
    """The linear motion about a state, with exact derivatives.

    Contacts that are closed in the state stay closed; their frictions slide where they move, and stick where they are
    at rest and can. Independent coordinates are chosen so that rows determine the others best. A is the exact Jacobian
    of their first-order equations at any state; at an equilibrium or a steady motion its eigenvalues do not depend on
    the choice, on the cut or on the order of rows. Time is held: driven motions are frozen at the state's instant.

    Parameters
    ----------
    model : a `Model` or `Lagrangian`
    state : from `assemble`, `run.final` or `run.at`
    parameters : values that differ from the model's, by name
    backend : see `mbd.simulate`; for `Linearization.rhs`

    Raises
    ------
    ModelError
        if the state is not consistent, a closed contact would pull, or the constraint Jacobian loses rank at this
        posture only.

    Examples
    --------
    >>> import mbd
    >>> model = mbd.Model("pendulum")
    >>> rod = mbd.Link("rod", mass=1.0, length=0.5, center=0.5)
    >>> model.connect(mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Viscous(0.1)))
    >>> print(mbd.linearize(model, mbd.assemble(model)))
    pendulum at t = 0 s, in equilibrium: 1 coordinate, no rows
      states: pin.angle, pin.angle.rate
        ω [rad/s]      f [Hz]  damping ζ  motion
          4.42945    0.704968     0.0452  pin.angle
    """
    found = instant(model, state, parameters, backend)
    equations, terms = found.mechanism.equations, found.terms()
    n_v = equations.n_v
    if n_v == 0:
        raise ModelError(f"{equations.name!r} has no coordinate; connect a body by a joint that lets it move")
    chosen = independent(terms.M[:n_v, :n_v], terms.B, terms.turning, found.velocity, equations.n_z)
    singular = _singular(found, terms, chosen)
    if singular:
        raise ModelError(singular)
    picked = (*chosen.places, *(n_v + k for k in chosen.speeds), *range(2 * n_v, 2 * n_v + equations.n_z))
    A = _motion(found, terms, n_v)[list(picked)] @ chosen.basis
    eigenvalues, shapes = _modes(A, chosen.basis[:n_v])
    places = tuple(name for name, _ in equations.configuration.freedoms)
    names = (*places, *equations.velocity_names, *(each.name for each in equations.states))
    return Linearization(
        equations.name, state.time, places, found.titles, tuple(names[k] for k in picked), terms.M[:n_v, :n_v],
        terms.C[:n_v, :n_v], terms.K[:n_v], terms.B, A, chosen.basis, np.concatenate([state.q, state.v, state.z]),
        np.concatenate([state.v, found.rate]), eigenvalues, shapes, picked, found,
    )  # fmt: skip


def _motion(found: Instant, terms: LinearTerms, n_v: int) -> Matrix:
    """Rates of (x, v, z) per change of (x, v, z), (2 n_v + n_z) square, rows held at acceleration level.

    ``[M R; B 0] (δv̇, δλ) = −[K C; ∂ḧ/∂x ∂ḧ/∂v] (δx, δv)``
    """
    n, B = len(terms.r), found.kept(terms.B)
    m = len(B)
    still = np.zeros((m, n - n_v))
    matrix = np.block([[terms.M, found.forces(terms)], [B, still, np.zeros((m, m))]]) if m else terms.M
    place, speed = found.kept(terms.change_place), found.kept(terms.change_speed)
    right = np.vstack([np.hstack([terms.K, terms.C]), np.hstack([place, speed, still])])
    full = np.zeros((n_v + n, n_v + n))
    full[:n_v, n_v : 2 * n_v] = np.eye(n_v)
    full[:n_v, :n_v] = terms.carried
    full[n_v:] = -np.linalg.solve(matrix, right)[:n]
    return full


def _singular(found: Instant, terms: LinearTerms, chosen: Independent) -> list[str]:
    """Rows that depend on others here but not nearby: their second derivatives along the free motions differ.

    For multipliers μ that make no force, ``∂(Bᵀμ)/∂x`` along the free motions vanishes where the rows agree nearby.
    """
    from scipy.linalg import null_space

    held = np.flatnonzero(~found.velocity)
    n_v, free = len(terms.K.T), chosen.basis[: len(terms.K.T), : len(chosen.places)]
    forces = terms.R[:, held] / row_sizes(terms.R[:, held].T)
    for idle in null_space(forces, rcond=NEGLIGIBLE).T if len(held) else ():
        extra = np.zeros(len(found.rows))
        extra[held] = idle / row_sizes(terms.R[:, held].T) * max(1.0, float(np.max(np.abs(found.lam), initial=0.0)))
        bent = (found.terms(extra).K - terms.K)[:n_v]
        if np.max(np.abs(free.T @ bent @ free), initial=0.0) > VANISHES * float(np.max(np.abs(bent), initial=0.0)):
            lost = [found.titles[k] for k in held[np.abs(idle) > 1e-6]]
            return [
                f"the constraint Jacobian loses rank at this posture only ({', '.join(lost)}), where branches of "
                "motion meet, so that no linear motion exists; move the state off it"
            ]
    return []


def _modes(A: Matrix, place: Matrix) -> tuple[Any, Any]:
    """Eigenvalues by magnitude, pairs side by side, and the shapes in the coordinates."""
    from scipy.linalg import eig

    values, vectors = eig(A)
    order = np.lexsort((-values.imag, values.real, np.round(np.abs(values), 12 - _digits(values))))
    values, shapes = values[order], place @ vectors[:, order]
    for k in range(len(values)):
        size = np.abs(shapes[:, k])
        largest = int(np.argmax(size >= (1.0 - 1e-9) * np.max(size, initial=0.0))) if len(size) else 0
        moves = np.linalg.norm(vectors[:, order[k]])
        shapes[:, k] = shapes[:, k] / shapes[largest, k] if size[largest] > 1e-10 * moves else 0.0
    return values, shapes


def _digits(values: Any) -> int:
    """Decimal places before the point of the largest magnitude."""
    largest = float(np.max(np.abs(values), initial=0.0))
    return int(np.ceil(np.log10(largest))) if largest > 0.0 else 0
