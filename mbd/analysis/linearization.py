"""Small motions about a state: mass, damping, stiffness, first-order equations with inputs and outputs, modes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mbd.analysis.descriptor import DescriptorForm, descriptor_form
from mbd.analysis.instant import Instant
from mbd.analysis.linear_motion import Prescribed
from mbd.analysis.ports import Input, Output, port_terms
from mbd.analysis.state_space import StateSpace
from mbd.arrays import ComplexArray, Matrix, Vector
from mbd.configuration import Configuration
from mbd.dataclass import dataclass
from mbd.equal import NOMINAL_RTOL
from mbd.later import later
from mbd.notes import doubt

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
    """The linear motion about a state: ``M δv̇ + C δv + K δq + Bᵀ δλ = 0``, reduced to ``δẋ = A δx + B δu``.

    Attributes
    ----------
    model : its name; time : of the state [s]
    coordinates : n_v names of the coordinates, in the order of the matrices below; those of velocities for joints whose
        coordinates do not add, with small displacements along these in axes that move with the child
    rows : m titles of the active rows
    mass_matrix, damping_matrix, stiffness_matrix : (n_v, n_v) derivatives M, C, K of the balance r by v̇, v and q, with
        the accelerations and multipliers of the state held: K has the geometric stiffness of multipliers, C gyroscopic
        terms; unsymmetric where forces are
    constraint_jacobian : (m, n_v) ∂h/∂q of the rows; of rows on velocities ∂ḣ/∂v
    state_space : A, B, C, D with the names and units of states, inputs and outputs; the attributes of these names are
        those of it. Its states are independent coordinates, independent rates, first-order states, and what inputs
        prescribe
    basis : (2 n_v + n_z, N) small changes of (q, v, z) for a unit change of each of `states`
    y : (n_q + n_v + n_z,) the state (q, v, z); drift : (2 n_v + n_z,) the rates of displacements, v and z: (v, v̇, ż)
    output_values : (o,) of the outputs at the state
    eigenvalues : (N,) of A by growing magnitude, conjugate pairs side by side [1/s]
    shapes : (n_v, N) the coordinates' part of each motion, largest part 1; of motions that move no coordinate 0
    """

    model: str
    time: float
    coordinates: tuple[str, ...]
    rows: tuple[str, ...]
    mass_matrix: Matrix
    damping_matrix: Matrix
    stiffness_matrix: Matrix
    constraint_jacobian: Matrix
    state_space: StateSpace
    basis: Matrix
    y: Vector
    drift: Vector
    output_values: Vector
    eigenvalues: Any
    shapes: Any
    picked: tuple[int, ...] = field(repr=False)
    instant: Instant = field(repr=False)
    prescribed: Vector = field(repr=False)
    has_ports: bool = field(repr=False)
    ends: tuple[tuple[Input, ...], tuple[Output, ...]] = field(repr=False)

    @property
    def states(self) -> tuple[str, ...]:
        """N names of the states."""
        return self.state_space.states

    @property
    def inputs(self) -> tuple[str, ...]:
        """k names of the inputs."""
        return self.state_space.inputs

    @property
    def outputs(self) -> tuple[str, ...]:
        """o names of the outputs; the states where none were asked for."""
        return self.state_space.outputs

    @property
    def M(self) -> Matrix:
        """`mass_matrix`."""
        return self.mass_matrix

    @property
    def K(self) -> Matrix:
        """`stiffness_matrix`."""
        return self.stiffness_matrix

    @property
    def A(self) -> Matrix:
        """(N, N) ∂ẋ/∂x."""
        return self.state_space.A

    @property
    def B(self) -> Matrix:
        """(N, k) ∂ẋ/∂u; without inputs= and outputs=, for this release, the constraint Jacobian."""
        return self.state_space.B if self.has_ports else self._renamed("B", "constraint_jacobian")

    @property
    def C(self) -> Matrix:
        """(o, N) ∂y/∂x; without inputs= and outputs=, for this release, the damping matrix."""
        return self.state_space.C if self.has_ports else self._renamed("C", "damping_matrix")

    @property
    def D(self) -> Matrix:
        """(o, k) ∂y/∂u."""
        return self.state_space.D

    def _renamed(self, letter: str, name: str) -> Matrix:
        doubt(
            f"linearize(…).{letter} is now called {name}; B, C and D are the matrices of inputs and outputs, see "
            "inputs= and outputs="
        )
        return np.asarray(getattr(self, name))

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
        configuration, y = self._configuration, self.y
        if not configuration.is_vector:
            places = np.append(y, 0.0)[configuration.places]  # increments of charts are 0 here
            y = np.append(places, y[configuration.n_q :])
        return np.append(y[list(self.picked)], self.prescribed)

    @property
    def _configuration(self) -> Configuration:
        return self.instant.mechanism.equations.configuration

    @property
    def is_equilibrium(self) -> bool:
        """Whether no independent rate changes; the rates themselves may be steady, as those of a governor."""
        n_v, rates = len(self.coordinates), [k for k, place in enumerate(self.picked) if place >= len(self.coordinates)]
        count = len(self.picked)
        moved = np.abs(self.x[:count]) + [float(place < n_v) for place in self.picked]
        caused = np.abs(self.A[rates][:, :count]) @ moved
        return bool(np.all(np.abs(self.drift[list(self.picked)][rates]) <= NOMINAL_RTOL * np.maximum(caused, 1e-3)))

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
        """``ẋ = ẋ₀ + A (x − x₀)`` of the states, x₀ = `x`: for `solve_ivp`."""
        change = np.asarray(x, dtype=float) - self.x
        still = np.zeros(len(self.prescribed))
        return np.asarray(np.append(self.drift[list(self.picked)], still) + self.A @ change)

    def discrete(self, dt: float, method: str = "zoh") -> StateSpace:
        """`StateSpace.discrete`."""
        return self._of_changes().discrete(dt, method)

    def to_scipy(self) -> Any:
        """`StateSpace.to_scipy`."""
        return self._of_changes().to_scipy()

    def to_control(self) -> Any:
        """`StateSpace.to_control`."""
        return self._of_changes().to_control()

    def transfer(self, s: Any) -> ComplexArray:
        """`StateSpace.transfer`."""
        return self.state_space.transfer(s)

    def frequency_response(self, frequencies: Any) -> ComplexArray:
        """`StateSpace.frequency_response`."""
        return self.state_space.frequency_response(frequencies)

    def descriptor(self) -> DescriptorForm:
        """The same motion with nothing eliminated, ``E ξ̇ = A ξ + B δu``, for those who treat rows themselves.

        Raises a `ModelError` where rows turn as the state moves.
        """
        inputs, outputs = self.ends
        local = port_terms(self.instant, inputs, outputs)
        given = Prescribed.of(inputs, local, self.instant.velocity)
        equations = self.instant.mechanism.equations
        names = *self.coordinates, *equations.velocity_names, *(each.name for each in equations.states)
        seen = [each.name for each in outputs]
        terms = self.instant.terms()
        form = descriptor_form(self.instant, terms, local, given, names, (self.inputs, seen))
        if outputs:
            return form
        places = [*self.picked, *range(len(form.E) - len(given.names), len(form.E))]
        direct = np.zeros((len(places), len(inputs)))
        return replace(form, C=np.eye(len(form.E))[places], D=direct, outputs=self.states)

    def _of_changes(self) -> StateSpace:
        """`state_space`; a warning where the state does not stay, so that its equations are those of an instant."""
        if not self.is_equilibrium:
            doubt(
                f"{self.model} is not in equilibrium at t = {self.time:g} s: these equations are of changes from a "
                "motion that goes on, frozen at this instant"
            )
        return self.state_space

    def plot_modes(self, path: str | Path | None = None, most: int = 6) -> Figure:
        """Mode shapes as bars, one panel for each of the `most` slowest motions that move a coordinate; the figure."""
        figure: Figure = later("Linearization.plot_modes")(self, path, most)
        return figure

    def __str__(self) -> str:
        from mbd.analysis.tables import linear_table

        return linear_table(self)

    __repr__ = __str__

    def _repr_html_(self) -> str:
        from mbd.analysis.tables import linear_html

        return linear_html(self)
