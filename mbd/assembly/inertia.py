"""Whether masses and constraints determine every motion, and whether double precision can carry the inertia of each.

The mass matrix of relative coordinates adds up everything outboard. What a motion that folds a chain up to and fro
has of inertia is a small difference of its entries; the kinetic energy, a sum over bodies, has no such cancellation.
"""

from __future__ import annotations

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.assembly.islands import alike_islands, islands_of_rows
from mbd.assembly.not_finite import first_cause, tape_inputs
from mbd.assembly.pose import Posture
from mbd.compile.orders import MIN_UNKNOWNS
from mbd.equal import ROUND_OFF_RTOL

ENERGY_RTOL = 1e-26
"""Kinetic energy of a motion, over what M adds up for it, below which it is that of round-off in velocities [-]."""
LOST_ENERGY_RTOL = 1e-17
"""The same below which not a digit of it is left in M, a tenth of the round-off in its entries [-]."""


def undetermined(work: Posture) -> list[str]:
    """Coordinates whose acceleration neither mass nor rows determine, rows that depend on others, negative inertia."""
    equations = work.equations
    picked = work.active_rows
    terms = work.terms()
    n = len(terms.f)
    if n == 0:
        return ["nothing can move: the model has no coordinate; connect a body by a joint that lets it move"]
    matrix = terms.saddle(picked)
    if not np.isfinite(matrix).all() or not np.isfinite(terms.f).all():
        block = work.mechanism.block(work.time, work.q, work.y, work.anchors)
        inputs = tape_inputs(work.mechanism, block, work.parameters)
        cause = first_cause(equations, inputs, when=" at the start")
        return [cause or "a mass or a derivative is not finite at the start; check the parameters and functions used"]
    if n == equations.n_v and not picked and _has_inertia(matrix):
        return []
    faults, lost = [], []
    for _, motion in _weak_motions(matrix, n):
        weights = np.abs(motion)
        place = int(np.argmax(weights))
        if np.max(weights[:n], initial=0.0) <= 1e-6 * weights[place]:
            continue
        name = equations.velocity_names[int(np.argmax(weights[: equations.n_v]))].removesuffix(".rate")
        share = _share(work, motion[:n], terms.M)
        if share > ENERGY_RTOL:
            lost += [lost_sentence(name, share)] if share < LOST_ENERGY_RTOL else []
            continue
        faults.append(
            f"nothing determines the motion of {name!r}: no mass or inertia resists it and no constraint holds it; "
            "give the bodies it moves a mass, or lock it"
        )
    faults = faults or lost[:1]
    return faults or _negative(work, terms.M[: equations.n_v, : equations.n_v], terms.B[picked][:, : equations.n_v])


def lost_inertia(work: Posture) -> str:
    """A sentence on the motion of least inertia where elimination has lost it; '' if it has none at all."""
    terms = work.terms()
    n, n_v = len(terms.f), work.equations.n_v
    matrix = terms.saddle(work.active_rows)
    if not np.isfinite(matrix).all():
        return ""
    for size, motion in reversed(_weak_motions(matrix, n)):
        if np.max(np.abs(motion[:n_v]), initial=0.0) > 1e-6 * np.max(np.abs(motion)):
            name = work.equations.velocity_names[int(np.argmax(np.abs(motion[:n_v])))].removesuffix(".rate")
            return lost_sentence(name, size) if _share(work, motion[:n], terms.M) > ENERGY_RTOL else ""
    return ""


def _weak_motions(matrix: Matrix, n: int) -> list[tuple[float, Vector]]:
    """Unknowns that the equations, scaled, hardly determine, the weakest last, with their relative singular values."""
    scaled, scale = _scaled(matrix)
    found, largest = list[tuple[float, Vector]](), 1e-300
    if len(matrix) < MIN_UNKNOWNS and _is_regular(scaled[np.newaxis], len(matrix)):
        return []
    groups = list(alike_islands(scaled, n))
    if all(_is_regular(scaled[islands[:, :, np.newaxis], islands[:, np.newaxis]], len(matrix)) for islands in groups):
        return []
    for islands in groups:
        _, sizes, right = np.linalg.svd(scaled[islands[:, :, np.newaxis], islands[:, np.newaxis]])
        largest = max(largest, float(np.max(sizes)))
        for place, k in zip(*np.nonzero(sizes < len(matrix) * ROUND_OFF_RTOL), strict=True):
            motion = np.zeros(len(matrix))
            motion[islands[place]] = right[place, k]
            found.append((float(sizes[place, k]), motion / scale))
    weak = [(size / largest, motion) for size, motion in found if size / largest < ROUND_OFF_RTOL]
    return sorted(weak, key=lambda each: -each[0])


def _scaled(matrix: Matrix) -> tuple[Matrix, Vector]:
    """A symmetric matrix over the roots of the largest numbers in its rows and columns, and these roots."""
    scale = np.sqrt(np.maximum.reduce(np.abs(matrix), axis=1))
    scale[scale == 0.0] = 1.0
    return matrix / (scale[:, np.newaxis] * scale), scale


def _has_inertia(M: Matrix) -> bool:
    """Whether factors of M tell that it resists every motion clearly; all that is looked at else is sound then."""
    if len(M) > 64:  # one factorization of all takes longer than one of each island
        return False
    scaled, _ = _scaled(M)
    scaled.flat[:: len(M) + 1] -= 1e-8  # eigenvalues above this are no round-off
    try:
        np.linalg.cholesky(scaled)
    except np.linalg.LinAlgError:
        return False
    return True


def _is_regular(blocks: Matrix, size: int) -> bool:
    """Whether the inverses, whose norms bound singular values, tell that none is small; cheaper than these values."""
    try:
        bound = np.linalg.norm(np.linalg.inv(blocks), axis=(1, 2))
    except np.linalg.LinAlgError:
        return False
    return bool(np.all(bound * size * ROUND_OFF_RTOL < 1.0))


def _is_definite(blocks: Matrix, least: float) -> bool:
    """Whether factors tell that all eigenvalues are above `least`, which is negative; cheaper than these values."""
    try:
        np.linalg.cholesky(blocks - 0.5 * least * np.eye(blocks.shape[-1]))
    except np.linalg.LinAlgError:
        return False
    return True


def lost_sentence(name: str, size: float) -> str:
    """What is said of a motion whose inertia, that part of what equations add up, is lost."""
    return (
        f"the motion of {name!r} has an inertia that double precision cannot carry: at most {size:.1g} of what the "
        "equations add up of everything that it moves, no more than round-off; give light and slender bodies an "
        "inertia about their own center, put fewer of them into one chain, or try cut='all', whose equations add up "
        "no masses"
    )


def _share(work: Posture, motion: Vector, M: Matrix) -> float:
    """Kinetic energy of a motion over what M adds up for it, ``(Σ √M_ii |v_i|)²/2``, however little; 0 if not known.

    A long chain that folds up to and fro hardly moves, and M, whose entries are sums over all bodies outboard, tells
    its energy as a difference of large numbers. As a sum over bodies it has no cancellation.
    """

    def kinetic(y: Vector) -> float:
        terms = work.terms(y=y)
        return float(np.asarray(terms.kinetic).item())

    if work.equations.n_z or kinetic(0.0 * motion) != 0.0:  # a moving ground has energy of its own
        return 0.0
    added = 0.5 * float(np.sqrt(np.abs(np.diag(M))) @ np.abs(motion)) ** 2
    return kinetic(motion) / added if added > 0.0 else 0.0


def _negative(work: Posture, M: Matrix, B: Matrix) -> list[str]:
    """Motions that the rows allow and whose kinetic energy would be negative."""
    scale = np.sqrt(np.abs(np.diag(M)) + 1e-300)
    scaled, rows = M / np.outer(scale, scale), B / scale
    least, motion = -1e-9, np.zeros(0)
    if len(M) < MIN_UNKNOWNS and _is_definite(scaled, least):
        return []
    for own, lines in islands_of_rows(scaled, rows):
        if _is_definite(scaled[own[:, :, np.newaxis], own[:, np.newaxis]], least):
            continue
        held = lines.shape[1]
        free = np.linalg.svd(rows[lines[:, :, np.newaxis], own[:, np.newaxis]])[2][:, held:] if held else None
        block = scaled[own[:, :, np.newaxis], own[:, np.newaxis]]
        values, directions = np.linalg.eigh(block if free is None else free @ block @ np.swapaxes(free, 1, 2))
        if values.size and np.min(values[:, 0]) <= least:
            place = int(np.argmin(values[:, 0]))
            least, motion = float(values[place, 0]), np.zeros(len(M))
            way = directions[place, :, 0]
            motion[own[place]] = np.abs(way if free is None else free[place].T @ way)
    if not len(motion):
        return []
    motion = motion / scale
    name = work.equations.velocity_names[int(np.argmax(motion))].removesuffix(".rate")
    guilty = [
        f"{each.name!r} is {value:g}"
        for each, value in zip(work.equations.parameters, work.parameters, strict=False)
        if value < 0.0 and each.name.rpartition(".")[2] in ("mass", "inertia", "xx", "yy", "zz")
    ]
    culprits = ", ".join(guilty) or "check the parameters given"
    return [f"the mass or inertia that resists the motion of {name!r} is negative; {culprits}"]
