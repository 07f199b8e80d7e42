"""Results of users' own that are no numbers somewhere are errors where they are asked for by name."""

import numpy as np

from mbd.arrays import Matrix, Vector
from mbd.errors import TrajectoryError
from mbd.results.facts import Facts


def require_finite(name: str, values: Vector | Matrix, time: Vector, facts: Facts) -> None:
    """Raise a `TrajectoryError` with the first instant at which an observation is not finite; others pass.

    Parameters
    ----------
    values : (R,) or (R, 3) at time (R,) [s]
    """
    observed = dict(facts.observations)
    if name not in observed and name.rpartition(".")[0] not in observed:
        return
    fine = np.asarray(np.isfinite(values).reshape(len(time), -1).all(axis=1))
    if not fine.all():
        wrong = int(np.argmin(fine))
        raise TrajectoryError(
            f"observation {name!r} is {np.ravel(values[wrong])[0]} at t = {time[wrong]:g} s, and no number at "
            f"{int(np.sum(~fine))} of {len(fine)} times; let its function avoid that, as in mbd.where(force > 0.0, "
            "moment / force, 0.0). Tables and files keep it as it is"
        )
