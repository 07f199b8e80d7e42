"""What each motion of a contact that slides in Painlevé's paradox would need, in numbers."""

import numpy as np

from mbd.equal import EQUAL_RTOL
from mbd.simulation.run.stepper import Stepper

NONE, SEVERAL = "no consistent contact force", "more than one consistent contact force"


def consistent_forces(stepper: Stepper, contact: int) -> tuple[str, str]:
    """How many forces a sliding contact may have at the accepted state, and a clause on them, '' if it is not known.

    Its gap accelerates by ``g̈ = g̈₀ + p dg̈/dp`` under its push p, with the friction that follows p, where the contacts
    that are closed and the frictions that stick go on as they are. Sliding needs ``g̈ = 0`` with ``p ≥ 0``, opening
    ``g̈₀ ≥ 0``. With ``dg̈/dp < 0`` neither is possible if ``g̈₀ < 0`` and both are if ``g̈₀ > 0`` (Painlevé 1895).
    """
    v = stepper.kernel
    flags, slips = v.closed[: v.n_contacts].copy(), v.slip[: v.n_frictions].copy()
    flags[contact] = 0
    held, normal, n = stepper.acting(flags), int(v.normal[contact]), v.n
    terms = stepper.terms(stepper.manager.penalties(flags), slips, v.lam[: v.n_rows])
    right = np.zeros((n + len(held), 2))
    right[:n, 0], right[n:, 0], right[:n, 1] = -terms.f, -terms.bias[held], terms.R[:, normal]
    try:
        free, gained = terms.B[normal] @ np.linalg.solve(terms.saddle(held), right)[:n]
    except np.linalg.LinAlgError:
        return NONE, ""
    free += terms.bias[normal]
    inertia = np.diag(terms.M)
    alone = float(np.sum(np.divide(terms.B[normal] ** 2, inertia, out=np.zeros(n), where=inertia > 0.0)))
    if not (np.isfinite(free) and gained < -EQUAL_RTOL * alone):  # other contacts hold it
        return NONE, ""
    each, push = f": each newton of it gives {gained:.3g} m/s² of the gap, so that ", abs(free / gained)
    if free < 0.0:
        return NONE, f"{each}sliding it would pull with {push:.3g} N, and open it would sink in with {-free:.3g} m/s²"
    return SEVERAL, f"{each}it may push with {push:.3g} N or open with {free:.3g} m/s², and nothing tells which"
