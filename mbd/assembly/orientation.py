"""Which way round cut joints in space are put together: rows that hold directions are 0 half a turn off too."""

from collections.abc import Sequence

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.assembly.pose import Posture
from mbd.compile.mechanism import Mechanism
from mbd.compile.python import ScalarFunction, scalar_function
from mbd.tape.derivatives import gradient

REVERSED_JOINT = (
    "{joint!r} is put together the wrong way round: its frames are {angle:.4g} rad from where it holds them"
)


def _function(mechanism: Mechanism) -> ScalarFunction:
    """(cos θ of every facing, their gradients)."""
    equations = mechanism.equations
    x = [equations.tape.input("x", k) for k in range(equations.n_v)]
    nodes = [facing.cosine for facing in equations.facings]
    slopes = [slope for node in nodes for slope in gradient(node, x)]
    return scalar_function([*nodes, *slopes], mechanism.layout, "facings")


def _evaluated(mechanism: Mechanism, block: Vector, parameters: Vector) -> tuple[Vector, Matrix]:
    """cos θ and its gradient for every facing."""
    function = mechanism.kept(_function, lambda: _function(mechanism))
    count = len(mechanism.equations.facings)
    out = np.zeros(function.size)
    with np.errstate(all="ignore"):
        function(block, parameters, out)
    return out[:count], out[count:].reshape(count, mechanism.equations.n_v)


def facing_cosines(mechanism: Mechanism, time: float, q: Vector, parameters: Vector, anchors: Vector) -> Vector:
    """cos θ of every `Facing`: 1 where its joint is put together as described."""
    if not mechanism.equations.facings:
        return np.zeros(0)
    block = mechanism.block(time, q, np.zeros(mechanism.layout.n), anchors)
    return _evaluated(mechanism, block, parameters)[0]


def reversed_joints(mechanism: Mechanism, time: float, q: Vector, parameters: Vector, anchors: Vector) -> list[str]:
    """A sentence for every cut joint that is put together the wrong way round."""
    cosines = facing_cosines(mechanism, time, q, parameters, anchors)
    return [
        REVERSED_JOINT.format(joint=facing.joint, angle=float(np.arccos(max(-1.0, min(1.0, cosine)))))
        for facing, cosine in zip(mechanism.equations.facings, cosines, strict=True)
        if cosine < 0.0
    ]


def faced(work: Posture, rows: Sequence[int], h: Vector, B: Matrix) -> tuple[Vector, Matrix, bool]:
    """Rows whose only zero is the joint, and whether one is half a turn off.

    The rows of a facing hold sines ``s``; with ``2 s/(1 + cos θ)``, twice the tangent of half the angle, Newton's
    method moves away from half a turn, where that has its pole.
    """
    facings = work.equations.facings
    if not facings:
        return h, B, False
    block = work.mechanism.block(work.time, work.q, work.y, work.anchors)
    cosines, slopes = _evaluated(work.mechanism, block, work.parameters)
    places, opposite = {row: k for k, row in enumerate(rows)}, False
    h, B = h.copy(), B.copy()
    for facing, cosine, slope in zip(facings, cosines, slopes, strict=True):
        picked = [places[row] for row in facing.rows if row in places]
        half = 0.5 * (1.0 + float(cosine))
        if not picked or not np.isfinite(slope).all() or not np.isfinite(half):
            continue
        if half < 1e-3:  # within 4° of half a turn
            opposite = True
            h[picked] = np.where(h[picked] < 0.0, -1.0, 1.0) * np.maximum(np.abs(h[picked]), np.pi)
            continue
        B[picked] = B[picked] / half - np.outer(h[picked], slope) * (0.5 / half**2)
        h[picked] = h[picked] / half
    return h, B, opposite
