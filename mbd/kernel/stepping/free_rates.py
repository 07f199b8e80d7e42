"""Accelerations of a tree on which no row acts, by articulated bodies (`mbd.equations.articulated_bodies`)."""

from mbd.equal import DIRECT_PIVOT_RTOL
from mbd.kernel.codes import FREE_RATES
from mbd.kernel.hooks import call
from mbd.kernel.records import Balance
from mbd.kernel.stepping.restart import fill_block
from mbd.kernel.tangent_rules import is_differentiated

NOT_CLEAR = -1.0
"""Of rates that lost too many digits, are not finite or cannot be found."""


def free_rates(K: Balance, t: float) -> float:
    """The same as `rates_in_block` at (q1, y1)."""
    if K.treelike == 0 or is_differentiated():
        return NOT_CLEAR
    fill_block(K, t, K.q1, K.y1)
    return rates_in_block(K)


def rates_in_block(K: Balance) -> float:
    """``v̇·M v̇`` of the rates v̇ at the state q ⊕ x, v in the block; `NOT_CLEAR` where M decides, or there is no program.

    v̇ is in K.jump, ẋ in K.spare. K.acc is left as it is.
    """
    if K.treelike == 0 or is_differentiated():
        return NOT_CLEAR
    n = K.n
    call(K, FREE_RATES, K.spare)
    pull = K.spare[2 * n + 1]
    if not (K.spare[2 * n] >= DIRECT_PIVOT_RTOL and abs(pull) < 1e300):
        return NOT_CLEAR
    K.jump[:n] = K.spare[n : 2 * n]
    return float(max(pull, 0.0))
