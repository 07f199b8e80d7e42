"""Many states moved onto the section at once, coordinates that were named left where they are.

Positions follow Newton's method on all that holds there, ``x ← x − Gᵀ (G Gᵀ)⁻¹ h`` over the increments without a
name; velocities, of which rows are linear, one such step over those without a name. States that do not come there keep
what is left, and the caller judges it.
"""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.compile.python import array_function
from mbd.equal import EQUAL_RTOL, SMALL_SUM_RTOL
from mbd.gait.section import Section
from mbd.tape.derivatives import gradient
from mbd.tape.node import Node


class OntoSection:
    """The rows of a section as functions of many states.

    Parameters
    ----------
    section : of a model; where coordinates do not add, positions move by increments
    named : places in (q, v, z) that stay, none of them a part of a quaternion
    """

    def __init__(self, section: Section, named: Collection[int]) -> None:
        equations = section.mechanism.equations
        self.section, n_q, n_v = section, equations.n_q, equations.n_v
        self.n_q, self.n_v = n_q, n_v
        self.configuration, places = equations.configuration, equations.configuration.places
        self.free_places = np.array([k for k in range(n_v) if places[k] < 0 or places[k] not in named], dtype=np.intp)
        self.free_rates = np.array([k for k in range(n_v) if n_q + k not in named], dtype=np.intp)
        with equations.tape.lock:
            x = [equations.tape.input("x", k) for k in range(n_v)]
            v = [equations.tape.input("v", k) for k in range(n_v)]
            values = [equations.rows[k].value for k in section.places] + _gaps(section)
            rates = [equations.rows[k].rate for k in section.rates]
            self._held = len(values), len(rates)
            self._positions = array_function([*values, *(slope for node in values for slope in gradient(node, x))])
            self._velocities = array_function([*rates, *(slope for node in rates for slope in gradient(node, v))])
            self._anchors = [k for contact in section.touching for k in contact.anchors]
            captured = [node for contact in section.touching for node in contact.captured]
            self._captured = array_function(captured) if self._anchors else None

    def __call__(
        self, q: Matrix, v: Matrix, z: Matrix, anchors: Matrix, parameters: Vector | Matrix
    ) -> NDArray[np.bool_]:
        """Move states (N, …) in place; whether each is on the section now."""
        inputs = {"t": np.zeros(len(q)), "q": q, "v": v, "z": z, "anchor": anchors}
        good = np.ones(len(q), dtype=bool)
        if self._held[0]:
            for _ in range(20):  # of positions, at most
                h, G = self._rows(self._positions, self._held[0], inputs, parameters)
                off = np.max(np.abs(h), axis=1)
                moving = (off > SMALL_SUM_RTOL) & np.isfinite(off)
                if not moving.any() or not len(self.free_places):
                    break
                step = _shortest(G[moving][:, :, self.free_places], h[moving])
                if self.configuration.is_vector:
                    q[np.ix_(moving, self.free_places)] -= step
                else:
                    move = np.zeros((len(step), self.n_v))
                    move[:, self.free_places] = -step
                    q[moving] = self.configuration.compose(q[moving], move)
                if np.max(np.abs(step)) < SMALL_SUM_RTOL:
                    break
            h, _ = self._rows(self._positions, self._held[0], inputs, parameters)
            good &= np.max(np.abs(h), axis=1) <= EQUAL_RTOL
        if self._captured is not None:
            anchors[:, self._anchors] = np.column_stack(self._captured(inputs, parameters))
        if self._held[1]:
            h, B = self._rows(self._velocities, self._held[1], inputs, parameters)
            fast = np.maximum(1.0, np.max(np.abs(v), axis=1, initial=0.0))
            moving = (np.max(np.abs(h), axis=1) > SMALL_SUM_RTOL * fast) & np.isfinite(h).all(axis=1)
            if len(self.free_rates) and moving.any():
                v[np.ix_(moving, self.free_rates)] -= _shortest(B[moving][:, :, self.free_rates], h[moving])
                h, _ = self._rows(self._velocities, self._held[1], inputs, parameters)
            good &= np.max(np.abs(h), axis=1) <= EQUAL_RTOL * fast
        return np.asarray(good)

    def _rows(self, function: object, count: int, inputs: dict[str, Matrix], parameters: Vector | Matrix) -> tuple[
        Matrix, NDArray[np.float64]
    ]:  # fmt: skip
        """Residuals (N, r) and slopes (N, r, n_v)."""
        found = np.column_stack(function(inputs, parameters))  # type: ignore[operator]
        return found[:, :count], found[:, count:].reshape(len(found), count, self.n_v)


def _gaps(section: Section) -> list[Node]:
    """The gaps of the event, which are zero, by their places among all guard values."""
    equations, contacts = section.mechanism.equations, len(section.manager.contacts)
    gaps = [equations.contacts[place].gap for place, _ in section.gaps if place < contacts]
    return gaps + [equations.guards[place - 4 * contacts].value for place, _ in section.gaps if place >= contacts]


def _shortest(rows: NDArray[np.float64], values: Matrix) -> Matrix:
    """The shortest x with rows x = values, (N, n)."""
    turned = rows.transpose(0, 2, 1)
    gram = rows @ turned
    size = np.trace(gram, axis1=1, axis2=2)
    # lest rows that depend on others divide by zero
    gram += (1e-13 * size + 1e-300)[:, np.newaxis, np.newaxis] * np.eye(gram.shape[1])
    return np.asarray((turned @ np.linalg.solve(gram, values[:, :, np.newaxis]))[:, :, 0])
