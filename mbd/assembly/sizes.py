"""Natural units of a mechanism: what a closing is judged and solved in, so that metres and kilograms decide nothing.

    increment x_i   X_i = 1 of an angle, L of a length, with L the longest lever arm |∂h/∂angle| of rows in metres, or
                    √(Σ J/Σ m) where that is longer; without angles the largest term of bilateral rows in metres,
                    else 1 m: the coordinates of a point tell of its place, not of a length
    row h_k         S_k = Σ|terms of h| or Σ|B_ki| X_i, what is larger; at least 1 of an angle
    mass M_ij       the largest |M_ii| X_i² of its cluster

Each cluster (`mbd.equations.clusters`) has a length of its own: what nothing connects says nothing of the others.
"""

from collections.abc import Sequence
from dataclasses import field
from typing import Any

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.compile.mechanism import AccelerationTerms, Mechanism
from mbd.dataclass import dataclass
from mbd.equations.clusters import clusters
from mbd.equations.equations import Contact, Equations


@dataclass(frozen=True)
class Sizes:
    """X of the increments (n_v,), that of the unit of each row and S (n_rows,), clusters, L, sizes of named results."""

    steps: Vector
    lengths: Vector
    rows: Vector
    cluster: Any
    cluster_of_row: Any
    longest: float
    of_conditions: dict[Any, float] = field(default_factory=dict)

    def metric(self, M: Matrix) -> Matrix:
        """M by increments over their sizes, each cluster over its largest entry; definite, as without mass it is not.

        So coordinates without inertia move at almost no cost.
        """
        scaled = self.steps[:, None] * M * self.steps
        heaviest = self._largest(np.abs(np.diag(scaled)))[self.cluster]
        heaviest[heaviest == 0.0] = 1.0
        return definite(np.asarray(scaled / heaviest[:, None]))

    def of_contact(self, contact: Contact) -> float:
        """What the gap of a contact is measured by: 1 of an angle, else L, the longest where a force alone acts."""
        if contact.unit == "rad":
            return 1.0
        return float(self.lengths[contact.rows[0]]) if contact.rows else self.longest

    def swiftest(self, y: Vector, terms: AccelerationTerms) -> Vector:
        """Of each cluster, the largest of the speeds over sizes, and of those that forces make in a size [1/s]."""
        n_v = len(self.steps)
        force, mass = _finite(terms.f[:n_v]), _finite(np.diag(terms.M)[:n_v]) * self.steps
        falling = np.sqrt(np.divide(force, mass, out=np.zeros(n_v), where=mass > 0.0))
        return self._largest(np.maximum(np.abs(y[:n_v]) / self.steps, falling))

    def _largest(self, values: Vector) -> Vector:
        """The largest of the values of coordinates of each cluster."""
        found = np.zeros(1 + max(*self.cluster, *self.cluster_of_row, 0, 0))
        np.maximum.at(found, self.cluster, values)
        return found

    def speeds(self, y: Vector, rows: Sequence[int], asked: Vector) -> Vector:
        """What rates of rows, then of named results, over their sizes are measured by [1/s].

        Of a row that is the fastest of its cluster and the largest that rows there and named results ask for, and at
        least a thousandth of the fastest of all, as all are solved for together; of a named result the largest of all.

        Parameters
        ----------
        y : velocities
        asked : (rows, named results) what is missing before velocities are completed, over sizes
        """
        of = self.cluster_of_row[list(rows)]
        found = self._largest(np.abs(y[: len(self.steps)]) / self.steps)
        np.maximum.at(found, of, np.abs(asked[: len(of)]))
        named = float(np.max(np.abs(asked[len(of) :]), initial=0.0))
        fastest = max(named, float(np.max(found)))
        return np.append(np.maximum(found[of], max(named, 1e-3 * fastest)), np.full(len(asked) - len(of), fastest))


def definite(M: Matrix) -> Matrix:
    """M with a little more of each inertia, whatever its unit; where there is none, with a little of the largest."""
    own = np.abs(np.diag(M))
    return M + 1e-9 * np.diag(np.where(own > 0.0, own, float(np.max(own, initial=0.0)) or 1.0))


def terms_and_sizes(
    mechanism: Mechanism, time: float, q: Vector, y: Vector, parameters: Vector, anchors: Vector
) -> tuple[AccelerationTerms, Matrix, Sizes]:
    """The equations at a state of a mechanism, (2, n_rows) Σ|terms| of h and ḣ, and the sizes there."""
    equations, layout = mechanism.equations, mechanism.layout
    n_v, n_rows = equations.n_v, len(equations.rows)
    block = mechanism.block(time, q, y, anchors)
    terms, found = mechanism.terms_of(block, parameters), np.zeros(mechanism.sizes["scales"])
    with np.errstate(all="ignore"):
        mechanism.common["scales"](block, parameters, found)
    of = np.array(mechanism.kept(clusters, lambda: clusters(equations)), dtype=int)
    cluster, of_row = of[:n_v], of[layout.n : layout.n + n_rows]
    units = np.array([row.unit for row in equations.rows], dtype=object)
    B, size = _finite(terms.B[:, :n_v]), _finite(found[layout.n : layout.n + n_rows])
    L = _lengths(equations, B, size, _finite(np.diag(terms.M)[:n_v]), cluster, of_row)
    steps = np.array(
        [L[c] if kind == "m" else 1.0 for c, (_, kind) in zip(cluster, equations.configuration.freedoms, strict=True)]
    )
    rows = np.maximum(size, np.abs(B) @ steps)
    rows = np.where(units == "rad", np.maximum(rows, 1.0), rows)
    rows = np.where(rows > 0.0, rows, np.where(units == "m", L[of_row], 1.0))
    own = np.where(units == "m", L[of_row], np.where(units == "rad", 1.0, rows))
    sizes = Sizes(steps, own, rows, cluster, of_row, float(np.max(L)))
    return terms, found[layout.n :].reshape(2, n_rows), sizes


def _lengths(equations: Equations, B: Matrix, size: Vector, mass: Vector, cluster: Any, of_row: Any) -> Vector:
    """L of each cluster."""
    angles, lengths = (
        np.array([kind == unit for _, kind in equations.configuration.freedoms], dtype=bool) for unit in ("rad", "m")
    )
    metres = np.array([row.unit == "m" for row in equations.rows], dtype=bool)
    held = metres & np.array([row.contact < 0 for row in equations.rows], dtype=bool)
    L, straight = np.zeros((2, 1 + max(*cluster, *of_row, 0, 0)))
    np.maximum.at(L, of_row[metres], np.max(B[metres][:, angles], axis=1, initial=0.0))
    heavy, turning = (np.bincount(cluster[each], mass[each], len(L)) for each in (lengths, angles))
    L = np.maximum(L, np.sqrt(np.divide(turning, heavy, out=np.zeros(len(L)), where=heavy > 0.0)))
    np.maximum.at(straight, of_row[held], size[held])
    return np.where(L > 0.0, L, np.where(straight > 0.0, straight, 1.0))


def sizes_of(mechanism: Mechanism, time: float, q: Vector, y: Vector, parameters: Vector, anchors: Vector) -> Sizes:
    """The sizes at a state of a mechanism."""
    return terms_and_sizes(mechanism, time, q, y, parameters, anchors)[2]


def _finite(values: Matrix) -> Matrix:
    """Sizes, 0 where a value is not finite."""
    return np.asarray(np.where(np.isfinite(values), np.abs(values), 0.0))
