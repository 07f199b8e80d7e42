"""Places of markers and rows of a model with their exact derivatives, as one compiled program."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mbd.arrays import Matrix, Vector
from mbd.bodies.base import Frame
from mbd.compile.backend import Function
from mbd.compile.many import at_inputs
from mbd.compile.mechanism import Mechanism
from mbd.dataclass import dataclass
from mbd.equations.equations import Equations
from mbd.equations.linearization import along_places
from mbd.errors import ModelError, nearest
from mbd.tape.node import Node


def point_names(equations: Equations, markers: Mapping[str, Any]) -> dict[str, str]:
    """The result that is the place of each marker, by name: 'left shank.end'.

    Raises
    ------
    ModelError
        for what is no point of the model, with what to write.
    """
    known = set(equations.output_names())
    found = {}
    for name, point in markers.items():
        title = point.full_name if isinstance(point, Frame) else point
        if not isinstance(title, str):
            raise ModelError(
                f"markers: {name!r} must be a point of the model such as shank.end, or its name, got {point!r}"
            )
        if f"{title}.x" not in known:
            if isinstance(point, Frame):
                x, y, z = point.offset
                raise ModelError(
                    f"markers: the model does not know the point of {name!r}; name it before the model is used: "
                    f"mbd.Marker({name!r}, {point.body.name.replace(' ', '_')}, ({x:g}, {y:g}, {z:g}))"
                )
            points = [each.removesuffix(".x") for each in known if each.endswith(".x")]
            raise ModelError(f"markers: {nearest(title, points, 'point', 'The model has')}")
        found[name] = title
    return found


@dataclass(frozen=True, eq=False)
class MarkerProgram:
    """``y(q ⊕ x)`` and ∂y/∂x for a list of scalars y: components of markers, coordinates, rows, limits.

    Attributes
    ----------
    function : y, then the entries of ∂y/∂x that are not always zero
    lines, columns : (E,) where these entries stand
    size : number of scalars y
    fixed : (size,) those that do not move with the model, such as the depth of a marker in the plane
    """

    mechanism: Mechanism
    function: Function
    lines: NDArray[np.intp]
    columns: NDArray[np.intp]
    size: int
    fixed: NDArray[np.bool_]

    def at(self, block: Vector, parameters: Vector, out: Vector, J: Matrix) -> Vector:
        """y at one state, with the derivatives put into J (size, n_v)."""
        self.function(block, parameters, out)
        J[self.lines, self.columns] = out[self.size :]
        return out[: self.size]

    def at_all(self, time: Vector, q: Matrix, parameters: Vector) -> tuple[Matrix, NDArray[np.float64]]:
        """y (R, size) and its derivatives (R, size, n_v) at many states."""
        y, entries = self.entries_at_all(time, q, parameters)
        J = np.zeros((len(time), self.size, self.mechanism.layout.n_v))
        J[:, self.lines, self.columns] = entries
        return y, J

    def entries_at_all(self, time: Vector, q: Matrix, parameters: Vector) -> tuple[Matrix, Matrix]:
        """y (R, size) and the entries of its derivatives (R, E) at many states."""
        out = at_inputs(self.function, self.mechanism.layout, {"t": time, "q": q}, parameters)
        return out[:, : self.size], out[:, self.size :]

    def transposed(self, entries: Matrix, r: Matrix) -> Matrix:
        """``Jᵀ r`` (R, n_v) of the entries of J, which stand column by column."""
        first = np.searchsorted(self.columns, np.arange(self.mechanism.layout.n_v + 1))
        terms = entries * r[:, self.lines]
        found = np.add.reduceat(np.pad(terms, ((0, 0), (0, 1))), first[:-1], axis=1)
        return np.asarray(np.where(np.diff(first) > 0, found, 0.0))


def marker_program(mechanism: Mechanism, points: Sequence[str], coordinates: Sequence[str], rows: Sequence[int],
                   gaps: Sequence[int]) -> MarkerProgram:  # fmt: skip
    """The program of some points (three scalars each), coordinates, rows and gaps of contacts, in this order."""
    key = (MarkerProgram, *map(tuple, (points, coordinates, rows, gaps)))
    return mechanism.kept(key, lambda: _made(mechanism, points, coordinates, rows, gaps))


def _made(mechanism: Mechanism, points: Sequence[str], coordinates: Sequence[str], rows: Sequence[int],
          gaps: Sequence[int]) -> MarkerProgram:  # fmt: skip
    equations = mechanism.equations
    nodes: list[Node] = [equations.output(f"{point}.{axis}") for point in points for axis in "xyz"]
    nodes += [equations.output(name) for name in coordinates]
    nodes += [equations.rows[k].value for k in rows]
    nodes += [equations.contacts[k].gap for k in gaps]
    along = along_places(equations, nodes)
    entries = [(i, j, column[i]) for j, column in enumerate(along) for i in range(len(nodes))]
    entries = [(i, j, node) for i, j, node in entries if not node.is_zero]
    functions = mechanism.backend.functions(mechanism.layout)
    functions.add({"markers": [*nodes, *(node for _, _, node in entries)]})
    lines = np.array([i for i, _, _ in entries], dtype=np.intp)
    columns = np.array([j for _, j, _ in entries], dtype=np.intp)
    fixed = ~np.isin(np.arange(len(nodes)), lines)
    return MarkerProgram(mechanism, functions["markers"], lines, columns, len(nodes), fixed)
