"""Steps that follow a tolerance, and that stability bounds: an explicit scheme on a stiff motion."""

from __future__ import annotations

import numpy as np

from mbd.arrays import Vector
from mbd.results.record import Record
from mbd.simulation.run.data import RunData

STABILITY_SHARE = 0.6
"""Step over the largest stable one from which stability bounds it: the control of steps stays below that [-]."""
POWER_ITERATIONS = 24
"""Of the power method, of which the second half tells the growth: of a pair of conjugates its mean [-]."""


def bounded_by_stability(run: RunData, record: Record) -> list[str]:
    """The note on a run whose steps are as long as an explicit scheme is stable; [] elsewhere.

    An accurate step of a motion of |s| [1/s] has |s| h well below the bound of stability; at the bound the motion has
    died away. |s| is the spectral radius of the equations of motion ẋ = f(x), found by the power method from
    differences of f (Hairer & Wanner, Solving Ordinary Differential Equations II, IV.2), when the run is over.
    """
    limit, steps = run.stepper.own.abilities.stability, int(run.kernel.n_steps)
    # nobody waits for so few
    if not (run.kernel.explicit and run.kernel.adaptive) or steps < 1000 or len(record.time) < 3:
        return []
    sizes = np.diff(record.time) * (len(record.time) - 1) / steps  # some rows may not be stored
    taken = np.flatnonzero(sizes > 0.0)
    chosen = taken[np.linspace(0, len(taken) - 1, 7).astype(int)[1:-1]]
    with np.errstate(all="ignore"):
        rates = np.array([_rate(run, record, int(row), float(sizes[row])) for row in chosen])
    stiff = rates * sizes[chosen] > STABILITY_SHARE * limit
    if np.mean(stiff) <= 0.5:
        return []
    scheme = type(run.stepper.integrator).__name__
    return [
        f"stability bounds the steps of {scheme}, not the tolerance: {steps} steps of about "
        f"{float(np.median(sizes[chosen])):.1g} s for a motion of {float(np.median(rates[stiff])):.2g} 1/s that has "
        "died away; the problem is stiff: mbd.RadauIIA() takes steps as long as the tolerance allows"
    ]


def _rate(run: RunData, record: Record, row: int, step: float) -> float:
    """Spectral radius of the equations of motion at a row [1/s]; 0 if not to be determined."""
    system, mode = run.stepper.system, run.manager.mode(record.closed[row])
    t, q, y = float(record.time[row]), record.q[row], np.concatenate([record.v[row], record.z[row]])
    n_v = len(record.v[row])
    weights = np.concatenate([np.ones(n_v), np.full(len(y), step)])  # what each moves in a step

    def slopes(x: Vector) -> Vector:
        moved = y + x[n_v:]
        rate, _ = system.accelerations(t, system.compose(q, x[:n_v]), moved, mode)
        return np.concatenate([moved[:n_v], rate])

    x = np.random.default_rng(0).standard_normal(len(weights)) / weights
    # by which the state is changed for differences
    size = 1e-7 * max(1.0, float(np.max(np.abs(q), initial=0.0)), step * float(np.max(np.abs(y), initial=0.0)))
    growth = []
    try:
        here = slopes(np.zeros(len(weights)))
        for _ in range(POWER_ITERATIONS):
            x = x * size / np.linalg.norm(weights * x)
            x = slopes(x) - here
            growth.append(float(np.linalg.norm(weights * x)) / size)
    except (ArithmeticError, np.linalg.LinAlgError):
        return 0.0
    late = np.array(growth[POWER_ITERATIONS // 2 :])
    return float(np.exp(np.mean(np.log(late)))) if np.isfinite(late).all() and late.all() else 0.0
