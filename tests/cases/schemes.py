"""The integrators that the cases are run with."""

import mbd
from mbd.integrators.family import NewmarkFamily

SCHEMES: list[NewmarkFamily] = [
    mbd.Newmark(),
    mbd.HHT(alpha=0.05),
    mbd.GeneralizedAlpha(rho_inf=0.9),
    mbd.GeneralizedAlpha(rho_inf=0.5),
]
"""Order 2; where rows act, position and velocity level are enforced."""

INDEX_3: list[NewmarkFamily] = [
    mbd.HHT(alpha=0.05, formulation="index3"),
    mbd.GeneralizedAlpha(rho_inf=0.8, formulation="index3"),
]
"""Position level only; undamped schemes are refused there (`test_refusals`)."""

WITH_ROWS = [*SCHEMES, *INDEX_3]


def name_of(scheme: object) -> str:
    """The scheme in a test's id."""
    return repr(scheme)
