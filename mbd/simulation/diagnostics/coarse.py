"""Steps of fixed size within which forces changed as nothing before them predicted, and the step that resolves them."""

import numpy as np

from mbd.results.record import Record
from mbd.simulation.diagnostics.fastest import resolving_dt
from mbd.simulation.run.data import RunData


def percent(share: float) -> str:
    """A share in whole percent, or with one digit below; never as 0 where there is any."""
    return f"{100.0 * share:.0f}" if share >= 0.01 else f"{100.0 * share:.1g}"


def coarse_steps(run: RunData, record: Record) -> list[str]:
    """The note on steps whose estimated errors of rates are more than a fifth of the rates; [] if there are none.

    A scheme of any order passes over a wall that is thinner than a step, as if it were elsewhere: the energy may be
    right by then, and the instant is not.
    """
    count = int(run.kernel.n_coarse)
    if not count or run.kernel.adaptive or len(record.time) < 2:
        return []
    worst, when = float(run.kernel.coarsest_change), float(run.kernel.coarsest_end)
    row = int(np.clip(np.searchsorted(record.time, when - 1e-9 * run.dt), 1, len(record.time) - 1))
    resolving = _resolving_step(run, record, row)
    smaller = f"dt <= {resolving:.1g} s, or " if resolving > 1e-6 * run.dt else ""  # than which no run would end
    steps = "a step was" if count == 1 else f"{count} steps were"
    return [
        f"{steps} not resolved by dt = {run.dt:g} s: forces changed within one so that rates are uncertain by "
        f"{percent(worst)} % (the most, at t = {when:.6g} s), and times and places after it as well; try "
        f"{smaller}tol="
    ]


def _resolving_step(run: RunData, record: Record, row: int) -> float:
    """The step that resolves the steepest change of forces between a row and the one before [s].

    ``ω² = max |Δa|/|Δq|`` along the cubic through both rows, of each cluster (`mbd.equations.clusters`), as far as the
    kinetic energy reaches against the forces.
    """
    system, h = run.stepper.system, float(record.time[row] - record.time[row - 1])
    blind = 0.1 * run.dt  # where forces do not show one
    if not run.mechanism.vector or not h > 0.0:
        return blind
    mode = run.manager.mode(record.closed[row])
    s = np.linspace(0.0, 1.0, 65)[:, None]  # parts of a step at whose ends forces are evaluated
    one, other, slope, end = record.q[row - 1], record.q[row], h * record.v[row - 1], h * record.v[row]
    q = one + s * slope + s**2 * (3.0 * (other - one) - 2.0 * slope - end) + s**3 * (slope + end - 2.0 * (other - one))
    v = record.v[row - 1] + s * (record.v[row] - record.v[row - 1])
    z, n_v = record.z[row - 1], record.v.shape[1]
    M = run.mechanism.acceleration_terms(
        float(record.time[row - 1]), one, np.concatenate([v[0], z]), run.kernel.params, system.anchors
    ).M[:n_v, :n_v]
    try:
        times = record.time[row - 1] + h * s[:, 0]
        a = np.array([
            system.accelerations(float(t), q[k], np.concatenate([v[k], z]), mode)[0][:n_v] for k, t in enumerate(times)
        ])  # fmt: skip
    except (ArithmeticError, np.linalg.LinAlgError):
        return blind
    steepest = 0.0
    cluster = np.array(run.stepper.clusters[:n_v])
    for c in set(cluster.tolist()):
        own = np.flatnonzero(cluster == c)
        moved, changed, inertia = np.diff(q[:, own], axis=0), np.diff(a[:, own], axis=0), M[np.ix_(own, own)]
        work = np.cumsum(np.einsum("ki,ij,kj->k", 0.5 * (a[1:, own] + a[:-1, own]), inertia, moved))
        energy = 0.5 * float(np.max([speeds[own] @ inertia @ speeds[own] for speeds in (v[0], v[-1])]))
        beyond = np.flatnonzero(np.abs(work) > energy)
        kept = slice(0, int(beyond[0]) + 1 if len(beyond) else None)
        ways, changes = np.linalg.norm(moved, axis=1)[kept], np.linalg.norm(changed, axis=1)[kept]
        steepest = max(steepest, float(np.max(changes[ways > 0.0] / ways[ways > 0.0], initial=0.0)))
    rate = float(np.sqrt(steepest))
    return min(resolving_dt(rate), blind) if np.isfinite(rate) and rate > 0.0 else blind
