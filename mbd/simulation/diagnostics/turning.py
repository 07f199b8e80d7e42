"""Angles that are too large to tell a pose, and turns that the steps of a run do not resolve."""

from collections.abc import Iterator

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.assembly.given_state import beyond_angles
from mbd.compile.mechanism import Mechanism
from mbd.compile.python import array_function
from mbd.kernel.stepping.charts import QUARTER_TURN
from mbd.results.columns import ModelColumns
from mbd.results.record import Record
from mbd.simulation.run.data import RunData
from mbd.simulation.run.stored import BLOCK
from mbd.tape.derivatives import live

HALF_TURN = np.pi
"""Turn in a step above which forces that follow the angle are read at too few places of a turn [rad]."""
MAX_LENGTH_RATIO = 1.7321
"""Largest length of a vector over its largest component, a little more than √3 [-]."""


def blocks(values: Matrix) -> Iterator[Matrix]:
    """Successive rows of a large table, few enough to need little memory; each begins with the end of the last."""
    for first in range(0, max(len(values) - 1, 1), BLOCK):
        yield values[first : first + BLOCK + 1]


def overturned(run: RunData) -> str:
    """An angle at the end of a run that is too large to tell a pose, in a sentence; '' without one."""
    found = beyond_angles(run.mechanism.equations, run.kernel.q[: run.kernel.n_q])
    return f"t = {run.now:.9g} s: {found[0]}: poses can no longer be told apart; end the run earlier" if found else ""


def unresolved_turns(run: RunData, record: Record) -> list[str]:
    """A note on each angle that turns by more than half a turn in a step, where the motion follows from the angle.

    Forces are then read at instants that may fall on the same angle again and again. Steps that follow a tolerance, and
    the explicit scheme, estimate that error themselves.
    """
    if run.kernel.adaptive or len(record.time) < 2:
        return []
    if not run.mechanism.vector:
        return _divided_steps(run, record)
    if run.kernel.explicit:
        return []
    if run.kernel.row_bounds[0] <= HALF_TURN:  # no coordinate changes so much from row to row
        return []
    equations, ways = run.mechanism.equations, _largest_ways(record)
    fast = [k for k, coordinate in enumerate(equations.coordinates) if coordinate.unit == "rad" and ways[k] > HALF_TURN]
    if not fast:
        return []
    with equations.tape.lock:
        nodes = [*equations.balance, *(node for row in equations.rows for node in (row.value, row.rate))]
        known = {node.data[1] for node in live(nodes) if node.op == "input" and node.data[0] == "q"}
    return [
        f"{equations.coordinates[k].name!r} turns by up to {ways[k]:.3g} rad in one step, and forces or masses follow "
        f"from it: read at so few places of a turn they may be far off; use dt below "
        f"{0.1 * run.dt * HALF_TURN / ways[k]:.1g} s"
        for k in fast
        if k in known
    ]


def _largest_ways(record: Record) -> Vector:
    """The most by which each coordinate changes in a step."""
    ways = np.zeros(record.q.shape[1])
    for part in blocks(record.q):
        if len(part) > 1:
            ways = np.maximum(ways, np.max(np.abs(np.diff(part, axis=0)), axis=0))
    return np.asarray(ways / record.settings.get("store", 1))


def _divided_steps(run: RunData, record: Record) -> list[str]:
    """A note on each joint whose coordinates do not add for which steps were divided (`mbd.kernel.stepping.charts`)."""
    found = list[str]()
    if run.dt * MAX_LENGTH_RATIO * float(np.max(np.abs(record.v), initial=0.0)) <= QUARTER_TURN:
        return found
    squares = record.v**2
    for name, turning in run.mechanism.turning:
        way = run.dt * float(np.sqrt(squares[:, turning].sum(axis=1).max()))
        if way > QUARTER_TURN:
            found.append(
                f"{name!r} turns by up to {way:.3g} rad in dt = {run.dt:g} s: steps were divided into parts that "
                f"turn it by a quarter turn at most, within which increments of a rotation are accurate; use dt below "
                f"{run.dt * QUARTER_TURN / way:.1g} s for steps of one size"
            )
    return found


def first_reversed(mechanism: Mechanism, columns: ModelColumns) -> tuple[str, float] | None:
    """The cut joint that is first the wrong way round in a stored row, and the time of that row."""
    facings, record = mechanism.equations.facings, columns.record
    if not facings or not len(record.time):
        return None
    cosines = mechanism.kept(first_reversed, lambda: array_function([facing.cosine for facing in facings]))
    rows = columns.rows
    found = cosines(columns.inputs(rows), record.parameters_at(rows.source))
    opposite = [
        (float(record.time[int(np.argmax(cosine < 0.0))]), facing.joint)
        for facing, cosine in zip(facings, found, strict=True)
        if np.min(cosine) < 0.0
    ]
    return (min(opposite)[1], min(opposite)[0]) if opposite else None
