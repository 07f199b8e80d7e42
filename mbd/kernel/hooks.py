"""What differs between the interpreted and the compiled kernel: calling model code, and the scheme.

Interpreted, model functions are Python callables and the scheme is any integrator's own `step`;
compiled, functions are called by address and the scheme is one of the kernel's own (see `build`).
"""

from mbd.kernel.records import Kernel, Model, Reals


def call(K: Model, number: int, out: Reals) -> None:
    """Evaluate model function `number` on the block and parameters."""
    K.code[number](K.block, K.params, out)


def call_on(K: Model, number: int, numbers: Reals, out: Reals) -> None:
    """Evaluate function `number` on other numbers than the block."""
    K.code[number](numbers, K.params, out)


def scheme_step(K: Kernel, h: float, t1: float) -> int:
    """Fill the candidate with the state at t1 = t + h; 0 or a failure code."""
    return int(K.hooks.step(K, h, t1))


def scheme_accept(K: Kernel, h: float) -> None:
    """Make the candidate the accepted state."""
    K.hooks.accept(K, h)


def scheme_resume(K: Kernel, h: float) -> int:
    """Start with what the scheme averages kept, after a step of size h; rates in K.jump, multipliers in K.impulse."""
    return int(K.hooks.resume(K, h))


def scheme_error(K: Kernel, h: float) -> None:
    """Fill K.error with the local error of the candidate, which a step of h has just made."""
    K.hooks.error(K, h)


def scheme_start(K: Kernel) -> int:
    """Start the scheme from the accepted, consistent state."""
    return int(K.hooks.start(K))
