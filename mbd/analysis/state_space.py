"""Equations of first order with named inputs and outputs, continuous or sampled, and the same in other libraries."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mbd.arrays import ComplexArray, Matrix
from mbd.bodies.values import is_number
from mbd.dataclass import dataclass
from mbd.equal import ROUND_OFF_RTOL
from mbd.errors import ModelError
from mbd.notebook import table
from mbd.results.tables import library

METHODS = ("zoh", "bilinear", "euler", "backward_diff", "foh", "impulse")
"""Ways to sample that `scipy.signal.cont2discrete` knows by a name alone."""


@dataclass(frozen=True, eq=False)
class StateSpace:
    """``δẋ = A δx + B δu``, ``δy = C δx + D δu``; with `dt` ``δx⁺ = A δx + B δu``.

    All are changes from the state about which a mechanism was linearized.

    Attributes
    ----------
    A, B, C, D : (N, N), (N, k), (o, N), (o, k)
    states, inputs, outputs : their names; state_units, input_units, output_units : '' where nothing tells
    dt : time between samples [s], None where time is continuous
    """

    A: Matrix
    B: Matrix
    C: Matrix
    D: Matrix
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    state_units: tuple[str, ...] = ()
    input_units: tuple[str, ...] = ()
    output_units: tuple[str, ...] = ()
    dt: float | None = None

    @property
    def poles(self) -> ComplexArray:
        """(N,) eigenvalues of A: s [1/s], or z of sampled equations."""
        return np.linalg.eigvals(self.A).astype(complex)

    @property
    def is_stable(self) -> bool:
        """Whether all poles decay: Re s < 0, or |z| < 1, by more than round-off of A may move them.

        Of entries that are off by ε each a pole with eigenvectors w and u is off by ``ε |w|ᵀ |A| |u| / |wᴴ u|`` (Golub
        & Van Loan 2013, Matrix Computations, 7.2): a mechanism without damping is not stable, whatever its numbers.
        """
        from scipy.linalg import eig

        if not len(self.A):
            return True
        poles, left, right = eig(self.A, left=True, right=True)  # type: ignore[misc]
        terms = np.einsum("ik,ij,jk->k", np.abs(left), np.abs(self.A), np.abs(right))
        decay = -poles.real if self.dt is None else 1.0 - np.abs(poles)
        return bool(np.all(decay * np.abs(np.einsum("ik,ik->k", left.conj(), right)) > ROUND_OFF_RTOL * terms))

    def discrete(self, dt: float, method: str = "zoh") -> StateSpace:
        """The equations from sample to sample, by `scipy.signal.cont2discrete`.

        Parameters
        ----------
        dt : time between samples [s]
        method : 'zoh' (inputs hold between samples, as those that a `Controller` writes; exact), 'bilinear', 'euler',
            'backward_diff', 'foh' or 'impulse'. Of 'bilinear', 'backward_diff' and 'foh' the states are scipy's, which
            inputs are mixed into; outputs are at samples what they are called
        """
        from scipy.signal import cont2discrete

        if self.dt is not None:
            raise ModelError(f"these equations are sampled already, every {self.dt:g} s; sample the continuous ones")
        if not is_number(dt) or not np.isfinite(dt) or dt <= 0.0:
            raise ModelError(f"dt must be a time between samples > 0 [s], not {dt!r}")
        if method not in METHODS:
            raise ModelError(f"method must be one of {', '.join(map(repr, METHODS))}, not {method!r}")
        self._require_inputs("discrete")
        sampled: Any = cont2discrete((self.A, self.B, self.C, self.D), float(dt), method=method)  # type: ignore[call-overload]
        A, B, C, D, _ = sampled
        return self._like(np.asarray(A), np.asarray(B), np.asarray(C), np.asarray(D), float(dt))

    def feedback(self, gain: Any) -> StateSpace:
        """The loop closed by ``δu = −K δy`` beside the inputs: ``A − B K (1 + D K)⁻¹ C``, and so on.

        Parameters
        ----------
        gain : K (k, o)
        """
        K, shape = np.asarray(gain, dtype=float), (len(self.inputs), len(self.outputs))
        if K.shape != shape or not np.all(np.isfinite(K)):
            raise ModelError(
                f"the gain must be finite numbers of shape {shape}, a row for each input and a column for each output "
                f"({', '.join(self.outputs)}), not {K.shape}"
            )
        try:
            inner = np.linalg.solve(np.eye(len(self.outputs)) + self.D @ K, np.hstack([self.C, self.D]))
        except np.linalg.LinAlgError:
            raise ModelError("1 + D K is singular: this gain sets outputs that follow inputs at once") from None
        C, D = np.hsplit(inner, [len(self.states)])
        return self._like(self.A - self.B @ K @ C, self.B - self.B @ K @ D, C, D, self.dt)

    def transfer(self, s: Any) -> ComplexArray:
        """``C (s − A)⁻¹ B + D`` at complex numbers s [1/s], z of sampled equations; (…, o, k) for s of shape (…)."""
        points = np.asarray(s, dtype=complex)
        eye = np.eye(len(self.states))
        try:
            inside = np.linalg.solve(points[..., None, None] * eye - self.A, self.B.astype(complex))
        except np.linalg.LinAlgError:
            raise ModelError("the transfer function is infinite at one of these points, which is a pole") from None
        return (self.C @ inside + self.D).astype(complex)

    def frequency_response(self, frequencies: Any) -> ComplexArray:
        """The transfer function at s = iω, or z = exp(iω dt), for ω [rad/s]; (…, o, k)."""
        w = np.asarray(frequencies, dtype=float)
        return self.transfer(1j * w if self.dt is None else np.exp(1j * w * self.dt))

    def to_scipy(self) -> Any:
        """A `scipy.signal.StateSpace`."""
        from scipy.signal import StateSpace as Scipy

        self._require_inputs("to_scipy")
        matrices = self.A, self.B, self.C, self.D
        return Scipy(*matrices) if self.dt is None else Scipy(*matrices, dt=self.dt)

    def to_control(self) -> Any:
        """A `control.StateSpace` of python-control with the names of states, inputs and outputs.

        That library keeps '.' for signals of connected systems, so that names have '_' in its place.
        """
        control = library("control", "control", "to_control()")
        self._require_inputs("to_control")
        names = {
            kind: [name.replace(".", "_") for name in getattr(self, kind)] for kind in ("states", "inputs", "outputs")
        }
        return control.ss(self.A, self.B, self.C, self.D, 0 if self.dt is None else self.dt, **names)

    def _require_inputs(self, what: str) -> None:
        if not self.inputs or not self.outputs or not self.states:
            missing = "inputs" if not self.inputs else "outputs" if not self.outputs else "states"
            raise ModelError(
                f"{what} needs equations with {missing}; give mbd.linearize(model, state, inputs=['drive.torque'], "
                "outputs=['hip.angle'])"
            )

    def _like(self, A: Matrix, B: Matrix, C: Matrix, D: Matrix, dt: float | None) -> StateSpace:
        names = self.states, self.inputs, self.outputs, self.state_units, self.input_units, self.output_units
        return StateSpace(A, B, C, D, *names, dt)

    def _cells(self) -> tuple[str, list[str], list[list[str]]]:
        """What the tables show: a title, the heads of the columns, and the rows."""
        kind = "continuous" if self.dt is None else f"sampled every {self.dt:g} s"
        counts = [_count(getattr(self, f"{word}s"), word) for word in ("state", "input", "output")]
        names = (*self.states, *self.inputs)
        units = [*(self.state_units or self.states), *(self.input_units or self.inputs)]
        heads = [f"{name} [{u}]" if u and u != name else name for name, u in zip(names, units, strict=True)]
        rates = [f"d/dt {name}" if self.dt is None else f"{name}⁺" for name in self.states]
        values = np.block([[self.A, self.B], [self.C, self.D]]) + 0.0  # + 0.0: no minus before zero
        rows = [
            [name, *(f"{value:.5g}" for value in row)]
            for name, row in zip((*rates, *self.outputs), values.tolist(), strict=True)
        ]
        return ", ".join([*counts, kind]), ["", *heads], rows

    def __repr__(self) -> str:
        title, heads, rows = self._cells()
        widths = [max(map(len, column)) for column in zip(heads, *rows, strict=True)]
        lines = [
            [row[0].ljust(widths[0]), *(cell.rjust(width) for cell, width in zip(row[1:], widths[1:], strict=True))]
            for row in (heads, *rows)
        ]
        return "\n".join([title, *("  " + "  ".join(line).rstrip() for line in lines)])

    def _repr_html_(self) -> str:
        return table(*self._cells())


def _count(names: Sequence[str], word: str) -> str:
    return f"{len(names) or 'no'} {word}{'s' * (len(names) != 1)}"
