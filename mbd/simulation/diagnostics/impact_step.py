"""The step that resolves the impacts of a penalty contact in a run: what `mbd.penalty_parameters` would say of them."""

from collections.abc import Iterable

import numpy as np

from mbd.arrays import Vector
from mbd.results.record import Record
from mbd.simulation.diagnostics.fastest import free_motions, matrices
from mbd.simulation.run.data import RunData


def dt_of_impacts(run: RunData, record: Record, number: int, rows: Iterable[int]) -> float:
    """A fifth of the time until the deepest point of the impacts of contact `number` that begin at some rows [s].

    With the effective mass ``1/(J M⁻¹ Jᵀ)`` along the rows that hold, J = ∂ġ/∂v, and the approach speed there; infinite
    where these cannot be determined.
    """
    name = run.manager.contacts[number].name
    law = next(word for word in run.model.contacts if word.name == name)
    inputs = run.mechanism.equations.parameters
    values = {parameter.name: float(v) for parameter, v in zip(inputs, run.kernel.params, strict=False)}
    given = {**law.parameters(), **values}
    found = np.inf
    with np.errstate(all="ignore"):
        for row in rows:
            speed, mass = _approach(run, record, number, row)
            if speed > 0.0 and 0.0 < mass < np.inf:
                found = min(found, law.resolving_dt(given, mass, speed))
    return float(found)


def _approach(run: RunData, record: Record, number: int, row: int) -> tuple[float, float]:
    """(approach speed [m/s, rad/s], effective mass [kg, kg m²]) of a contact at a row; zeros where not known."""
    y, n_v = np.concatenate([record.v[row], record.z[row]]), record.v.shape[1]
    rate = _gap_rate(run, record, number, row, y)
    J = np.zeros(len(y))
    for k in range(n_v):  # linear in v
        moved = y.copy()
        moved[k] += 1.0
        J[k] = _gap_rate(run, record, number, row, moved) - rate
    found = matrices(run, record, row)
    if found is None:
        return 0.0, 0.0
    free = free_motions(found.B, len(y))
    along = free.T @ J
    return -rate, float(1.0 / (along @ np.linalg.lstsq(free.T @ found.M @ free, along)[0]))


def _gap_rate(run: RunData, record: Record, number: int, row: int, y: Vector) -> float:
    anchors = run.kernel.anchors[: run.kernel.n_anchors]
    block = run.mechanism.block(float(record.time[row]), record.q[row], y, anchors)
    out = np.zeros(run.mechanism.sizes["guards"])
    run.mechanism.common["guards"](block, run.kernel.params, out)
    return float(out[run.kernel.n_contacts + number])
