"""The restart just beyond a singular configuration."""

from mbd.kernel.events.guards import update_armed, update_sides, watch
from mbd.kernel.hooks import scheme_resume
from mbd.kernel.records import Kernel
from mbd.kernel.stepping.accept_restart import project_velocity
from mbd.kernel.stepping.restart import consistent, stepping_rows


def leave_singularity(K: Kernel, h: float) -> int:
    """Just beyond a singularity: velocities on the rows again, rates and multipliers consistent.

    The scheme restarts, but for the average of accelerations that it carries. The rows are those that were stepped
    with: which depend on which is judged too badly here.
    """
    status = project_velocity(K, K.time, K.q, K.y, stepping_rows(K), False)
    if status == 0:
        status = consistent(K, K.time, K.q, K.y)
    if status != 0:
        return status
    status = scheme_resume(K, h)
    if K.n_watched > 0:
        watch(K, K.time, K.q, K.y, K.rate, K.lam, K.guards0)
        update_armed(K)
        update_sides(K)
    return status
