"""What follows multipliers at a state: R, which maps them to forces, and the limits of frictions."""

from mbd.kernel.codes import ACCELERATIONS
from mbd.kernel.contact.cones import fill_slips
from mbd.kernel.hooks import call
from mbd.kernel.records import ContactRows, Model, Reals


def evaluate_loaded(K: ContactRows, lam: Reals) -> float:
    """K.acc again with other multipliers, at the state already in the block; how far they differ from those before.

    Only R and the limits of frictions follow them.
    """
    change = 0.0
    size = 1e-300
    for k in range(K.n_rows):
        change = max(change, abs(K.block[K.o_lam + k] - lam[k]))
        size = max(size, abs(lam[k]))
        K.block[K.o_lam + k] = lam[k]
    fill_slips(K)
    call(K, ACCELERATIONS, K.acc)
    return change / size


def limit_of(K: Model, f: int) -> float:
    """Largest friction at the multipliers now in the block."""
    return float(K.acc[K.acc_limit + f])
