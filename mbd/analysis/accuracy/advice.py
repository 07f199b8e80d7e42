"""What the points of the lab mean, in plain words: the cheapest for an error, and what ten times less would cost."""

import math
from collections.abc import Sequence

from mbd.analysis.accuracy.points import Point

ACCURACY_FACTOR = 10.0
"""Times more accuracy whose cost is reported."""


def cheapest(points: Sequence[Point], target: float) -> Point | None:
    """The point of least time whose error is certainly no larger than the target."""
    able = [point for point in points if point.reaches(target)]
    return min(able, key=lambda point: point.seconds, default=None)


def decades(points: Sequence[Point]) -> list[float]:
    """Powers of ten between the largest and the smallest error, each reached by some point."""
    known = [point.at_most for point in points if not point.failure and point.at_most and math.isfinite(point.at_most)]
    if not known:
        return []
    first, last = math.floor(math.log10(max(known))), math.ceil(math.log10(min(known)))
    return [10.0**k for k in range(min(first, -1), last - 1, -1)]


def advice(points: Sequence[Point], target: float | None, bound: float) -> list[str]:
    """Three sentences at most: what to take for which error and what it costs, what limits, what to try.

    Parameters
    ----------
    target : error that is wanted, relative to the range of each quantity [-]; None: small, middle and large ones
    bound : of the reference [-]
    """
    if all(point.failure for point in points):
        return ["No run succeeded, so nothing can be recommended."]
    if not any(point.at_most is not None for point in points if not point.failure):
        return ["No error is known, so nothing can be recommended."]
    if target is None:
        found = _choices(points)
        if not found:
            return [f"No point has an error below a tenth; the best is {_described(_best(points))}."]
        texts = [f"{_power(error)} use {_described(best)}" for error, best in found]
        return [f"For an error of {'; of '.join(texts)}.", _limits(points, bound), _to_try(points)]
    best = cheapest(points, target)
    if best is None:
        return _unreached(points, target, bound)
    return [
        f"For an error of {_power(target)} use {_described(best)}.",
        _costs(best),
        _more(points, best, target / ACCURACY_FACTOR, bound),
    ]


def _choices(points: Sequence[Point]) -> list[tuple[float, Point]]:
    """(error, cheapest point) for a large, a middle and a small error, of those that have points of their own."""
    least: dict[int, tuple[float, Point]] = {}
    for error in decades(points):
        best = cheapest(points, error)
        if best is not None:
            least[id(best)] = (error, best)  # the smallest error that it is the cheapest for
    found = list(least.values())
    return [found[k] for k in sorted({0, len(found) // 2, len(found) - 1})] if found else []


def _power(error: float) -> str:
    """'1e-3'."""
    return f"{error:.3g}" if error >= 0.01 else f"{error:.2e}".replace(".00e", "e").replace("e-0", "e-")


def _limits(points: Sequence[Point], bound: float) -> str:
    """Why no smaller error is shown."""
    best = _best(points)
    # below that much of the bound of the reference an error is mostly that of the reference
    if best.at_most is not None and best.at_most < 30.0 * bound:
        return f"Smaller errors cannot be told apart: the reference itself is known to {bound:.1g}."
    guess = _extrapolated(points, (best.at_most or 0.0) / ACCURACY_FACTOR)
    if guess is None:
        return f"The least error of all points is {best.at_most:.2g}, and no order tells what a smaller one costs."
    scheme, dt, seconds = guess
    return (
        f"The steps limit the error; a tenth of the least of all would need dt = {dt:.2g} s and "
        f"{milliseconds(seconds)} with {scheme}, by its order."
    )


def _to_try(points: Sequence[Point]) -> str:
    """What to do next."""
    able = [point for point in points if not point.failure]
    if len(able) < len(points):
        return f"Take shorter steps where points failed ({len(points) - len(able)} of {len(points)})."
    others = [point for point in able if not point.same_events]
    if others:
        return f"Take shorter steps where events are others than the reference's ({len(others)} points, marked ≠)."
    if all(point.tol is None for point in able):
        return "Try simulate(…, tol=…), which finds the step by itself; tols=[…] shows here what it costs."
    return "Try target=…, which takes steps and tolerances around the error that you want."


def _described(point: Point) -> str:
    size = f"error {point.error:.2g}" if point.error is not None else f"error below {point.at_most:.2g}"
    return f"{point.scheme} with {point.setting} ({size}, {milliseconds(point.seconds)})"


def milliseconds(seconds: float) -> str:
    """Wall time with two digits.

    >>> milliseconds(0.01234), milliseconds(2.5)
    ('12 ms', '2.5 s')
    """
    number = float(f"{seconds if seconds >= 1.0 else 1e3 * seconds:.2g}")
    return f"{number:g} {'s' if seconds >= 1.0 else 'ms'}"


def _costs(point: Point) -> str:
    """What comes along with a point."""
    parts = [f"the scheme itself gains or loses up to {point.energy:.2g} J"]
    if point.drift or point.drift_rate:
        parts.append(f"rows are off by {point.drift:.2g}, their rates by {point.drift_rate:.2g}")
    if point.events and point.event_time is not None:
        parts.append(f"events come up to {point.event_time:.2g} s early or late")
    if not point.same_events:
        parts.append("its events are not those of the reference")
    return f"With it {', '.join(parts)}."


def _more(points: Sequence[Point], best: Point, target: float, bound: float) -> str:
    """What a tenth of the error costs: measured, or extrapolated from the finest step."""
    if best.reaches(target) and best.at_most:
        text, target = "It is ten times more accurate already; ten times more than that", best.at_most / ACCURACY_FACTOR
    else:
        text = "Ten times more accuracy"
    finer = cheapest(points, target)
    if finer is not None:
        ratio = finer.seconds / best.seconds
        times = f"{ratio:.2g} times the time" if ratio > 1.05 else "no more time"
        return f"{text} costs {times}: {_described(finer)}."
    if bound >= target:
        return f"{text} cannot be shown: the reference itself is known to {bound:.1g} only."
    guess = _extrapolated(points, target)
    if guess is None:
        return f"{text} was not reached by any of these, nor do their orders tell what it costs."
    scheme, dt, seconds = guess
    return (
        f"{text} was not measured; by its order {scheme} would need dt = {dt:.2g} s and "
        f"{milliseconds(seconds)}, {seconds / best.seconds:.2g} times the time."
    )


def _extrapolated(points: Sequence[Point], target: float) -> tuple[str, float, float] | None:
    """(scheme, dt, seconds) of the cheapest by the orders at the finest steps, time being that of the steps."""
    finest: dict[str, tuple[str, float, float]] = {}
    fixed = [(point.dt, point) for point in points if point.dt is not None]
    for dt, point in sorted(fixed, key=lambda each: each[0], reverse=True):
        if point.failure or point.error is None or point.order is None or point.order < 0.5 or point.error <= target:
            continue
        factor = (point.error / target) ** (1.0 / point.order)
        finest[point.scheme] = (point.scheme, dt / factor, point.seconds * factor)
    return min(finest.values(), key=lambda guess: guess[2], default=None)


def _best(points: Sequence[Point]) -> Point:
    """The most accurate; some error is known."""
    able = [point for point in points if not point.failure and point.at_most is not None]
    return min(able, key=lambda point: point.at_most or 0.0)


def _unreached(points: Sequence[Point], target: float, bound: float) -> list[str]:
    """The best that was reached, and why no more."""
    best = _best(points)
    sentences = [f"An error of {target:g} is not reached; the best is {_described(best)}."]
    if bound >= target:
        return [*sentences, f"The reference itself is known to {bound:.1g} only, so no run can be shown to do better."]
    guess = _extrapolated(points, target)
    if guess is None:
        return [*sentences, "No order can be observed, so that the step it needs cannot be determined."]
    scheme, dt, seconds = guess
    return [
        *sentences,
        f"The steps are too large: by its order {scheme} would need dt = {dt:.2g} s and {milliseconds(seconds)}. Give "
        "finer dts; below some error round-off is all that is left.",
    ]
