"""Guards between the ends of a step: their cubic Hermite interpolant, its turn and its zero."""

from mbd.kernel.algebra.roots import sqrt


def hermite_turn(g0: float, g1: float, d0: float, d1: float, rising: bool) -> float:
    """Place in (0, 1) of the interior maximum (rising) or minimum of the cubic Hermite interpolant; −1 if none."""
    a = 3.0 * (d0 + d1 - 2.0 * (g1 - g0))
    b = 2.0 * (3.0 * (g1 - g0) - 2.0 * d0 - d1)
    root = b * b - 4.0 * a * d0
    if root < 0.0:
        return -1.0
    root = sqrt(root)
    for attempt in range(2):
        far = b + root if b >= 0.0 else b - root
        place = -2.0 * d0 / far if attempt == 0 and far != 0.0 else (-far / (2.0 * a) if a != 0.0 else -1.0)
        if 0.0 < place < 1.0:
            curvature = 2.0 * a * place + b
            if (curvature < 0.0) == rising:
                return place
    return -1.0


def hermite(g0: float, g1: float, d0: float, d1: float, s: float) -> float:
    """Cubic Hermite interpolant at s in [0, 1]; d are rates times the step."""
    u = 1.0 - s
    return g0 * (1.0 + 2.0 * s) * u * u + g1 * s * s * (3.0 - 2.0 * s) + d0 * s * u * u - d1 * s * s * u


def crossing(value0: float, value1: float) -> float:
    """Fraction at which a straight line through two values of opposite sign is zero."""
    change = value0 - value1
    if change == 0.0:
        return 0.5
    return min(max(value0 / change, 0.0), 1.0)


def first_guess(f_low: float, f_high: float, d_low: float, d_high: float) -> float:
    """Fraction at which the cubic Hermite interpolant from f_low > 0 to f_high < 0 is zero; d: rates times width."""
    if d_low == 0.0 and d_high == 0.0:
        return f_low / (f_low - f_high)
    low = 0.0
    high = 1.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        if hermite(f_low, f_high, d_low, d_high, middle) > 0.0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)
