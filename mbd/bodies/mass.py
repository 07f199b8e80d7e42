"""Mass, center of mass and inertia, as scalars for the derivation and as numbers for the check."""

from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

import numpy as np

from mbd.arrays import Matrix
from mbd.bodies.algebra import IDENTITY, ZERO, Rotation, Triple
from mbd.bodies.values import is_several, number, numbers
from mbd.dataclass import dataclass
from mbd.equal import EQUAL_RTOL
from mbd.errors import ModelError
from mbd.tape.node import Scalar

Inertia: TypeAlias = float | tuple[float, ...]
"""About the center of mass in body axes [kg m²]: a number (about z), (Ixx, Iyy, Izz), or these and (Ixy, Ixz, Iyz)."""


_ELEMENTS = ("xx", "yy", "zz", "xy", "xz", "yz")


@dataclass(frozen=True)
class MassProperties:
    """What a body weighs: mass m [kg], center of mass [m], inertia matrix about the center, body axes [kg m²]."""

    mass: Scalar = 0.0
    center: Triple = ZERO
    inertia: Rotation = tuple(ZERO for _ in IDENTITY)  # type: ignore[assignment]


def inertia_of(value: Any, what: str) -> Inertia:
    """The inertia as users may give it, checked for its shape.

    >>> inertia_of((1, 2, 3), "inertia")
    (1.0, 2.0, 3.0)
    >>> inertia_of([[1, 0.1, 0], [0.1, 2, 0], [0, 0, 3]], "inertia")
    (1.0, 2.0, 3.0, 0.1, 0.0, 0.0)
    """
    rows = _rows(value)
    if rows is not None:
        return _of_matrix([numbers(row, what) for row in rows], what)
    if not is_several(value):
        return number(value, what)
    result = numbers(value, what)
    if len(result) not in (3, 6):
        raise ModelError(
            f"{what} must be a number (about z), (Ixx, Iyy, Izz), (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) or a 3 × 3 matrix; "
            f"got {len(result)} numbers"
        )
    return result


def _rows(value: Any) -> list[Any] | None:
    """The rows of a matrix; None of what is none."""
    if not is_several(value):
        return None
    rows = list(value)
    several = [is_several(row) for row in rows]
    return rows if rows and all(several) else None


def _of_matrix(rows: list[tuple[float, ...]], what: str) -> Inertia:
    """The elements of a symmetric matrix."""
    matrix = np.array(rows) if {len(row) for row in rows} == {3} else np.empty(0)
    if matrix.shape != (3, 3):
        shape = " and ".join(str(len(row)) for row in rows)
        raise ModelError(f"{what}: a matrix of 3 rows of 3 numbers is expected, got rows of {shape}")
    if np.abs(matrix - matrix.T).max() > EQUAL_RTOL * np.abs(matrix).max():
        raise ModelError(f"{what}: the matrix is not symmetric; Ixy, Ixz and Iyz stand on both sides of its diagonal")
    moments, products = matrix.diagonal(), matrix[[0, 0, 1], [1, 2, 2]]
    return tuple(float(each) for each in ((*moments, *products) if products.any() else moments))


def inertia_fields(inertia: Inertia) -> dict[str, float]:
    """The run-time parameters of an inertia: 'inertia', or 'inertia.xx', 'inertia.yy', …"""
    if isinstance(inertia, float):
        return {"inertia": inertia}
    return {f"inertia.{element}": value for element, value in zip(_ELEMENTS, inertia, strict=False)}


def inertia_matrix(inertia: Inertia, parameter: Callable[[str], Scalar]) -> Rotation:
    """The symmetric inertia matrix; Ixy, Ixz, Iyz are its elements (``Ixy = −∫ x y dm``)."""
    if isinstance(inertia, float):
        return ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, parameter("inertia")))
    I = dict.fromkeys(_ELEMENTS, 0.0) | {  # noqa: E741
        field.removeprefix("inertia."): parameter(field) for field in inertia_fields(inertia)
    }
    return ((I["xx"], I["xy"], I["xz"]), (I["xy"], I["yy"], I["yz"]), (I["xz"], I["yz"], I["zz"]))


def inertia_faults(owner: str, inertia: Inertia, values: Mapping[str, float]) -> list[str]:
    """What no body can have: a negative moment, or principal moments that break the triangle inequality.

    An inertia with exactly Ixx = Iyy = 0 is planar, meant for motion in x–y, and only its Izz is judged.

    Parameters
    ----------
    owner : name of the body
    inertia : as described, which says what parameters there are
    values : of the body's parameters by full name
    """
    matrix = np.array(inertia_matrix(inertia, lambda field: values[f"{owner}.{field}"]), dtype=float)
    largest = float(np.abs(matrix).max())
    faults = _moment_faults(owner, matrix, largest)
    if values[f"{owner}.mass"] == 0.0 and largest > 0.0:
        faults.append(f"body '{owner}': an inertia without a mass; give the mass, or inertia 0")
    return faults


def _moment_faults(owner: str, matrix: Matrix, largest: float) -> list[str]:
    """Those of the principal moments, whose largest entry is given."""
    if matrix[0, 0] == 0.0 and matrix[1, 1] == 0.0 and not matrix[[0, 0, 1], [1, 2, 2]].any():
        moments = np.array([matrix[2, 2]])
    else:
        moments = np.linalg.eigvalsh(matrix)
    if moments.min() < -1e-12 * largest:
        return [
            f"body '{owner}': its inertia has the negative principal moment {moments.min():.6g} kg m²; "
            "moments about the center of mass are ≥ 0"
        ]
    if len(moments) == 3 and moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-9):
        a, b, c = moments
        return [
            f"body '{owner}': principal moments {a:.6g}, {b:.6g}, {c:.6g} kg m² break the triangle inequality "
            f"({c:.6g} > {a:.6g} + {b:.6g}); give moments about the center, or a single number for planar motion"
        ]
    return []
