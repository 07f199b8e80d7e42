"""Results of analyses as lines of text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from mbd.notebook import paragraphs, table

if TYPE_CHECKING:
    from mbd.analysis.linearization import Linearization
    from mbd.analysis.numerical import Criteria

MAX_NAMED = 4
"""Coordinates that are named in a line at most."""

SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def linear_table(linear: Linearization) -> str:
    """States, then each mode with frequency, damping ratio and the coordinates that move most."""
    count, rows = len(linear.coordinates), len(linear.rows)
    kind = "not in equilibrium"
    if linear.is_equilibrium:
        kind = "in steady motion" if np.any(linear.y[count : 2 * count]) else "in equilibrium"
    size = f"{count} coordinate{'s' * (count != 1)}, {rows or 'no'} row{'s' * (rows != 1)}"
    if not linear.states:
        return f"{linear.model} at t = {linear.time:g} s: {size}\n  no states: rows determine the motion"
    lines = [f"{linear.model} at t = {linear.time:g} s, {kind}: {size}", f"  states: {', '.join(linear.states)}"]
    zero = 3e-8 * float(np.max(linear.frequencies, initial=0.0))  # double eigenvalues are known to √ε only
    still = int(np.count_nonzero(linear.frequencies <= zero))
    lines.append(f"  {'ω [rad/s]':>11} {'f [Hz]':>11} {'damping ζ':>10}  motion")
    for mode in linear.modes:
        if mode.frequency > zero:
            grows = ", grows" if mode.eigenvalue.real > 1e-9 * mode.frequency else ""
            numbers = f"{mode.frequency:>11.6g} {mode.hertz:>11.6g} {_plain(mode.damping_ratio):>10}"
            if mode.eigenvalue.imag == 0.0:
                rate = f"exp({mode.eigenvalue.real:.6g} t)"
                numbers = f"{rate:>23} {_plain(mode.damping_ratio):>10}"
            lines.append(f"  {numbers}  {_movers(mode.shape)}{grows}")
    if still:
        lines.append(f"  {still} eigenvalue{'s' * (still != 1)} 0: motions that nothing drives back")
    if linear.has_ports:
        lines += [f"  inputs: {', '.join(linear.inputs) or 'none'}", f"  outputs: {', '.join(linear.outputs)}"]
    return "\n".join(lines)


def linear_html(linear: Linearization) -> str:
    """The same as a table of modes for a notebook."""
    head, *rest = linear_table(linear).split("\n")
    rows = [
        (
            str(k), f"{mode.eigenvalue.real:.6g} {mode.eigenvalue.imag:+.6g}i", f"{mode.frequency:.6g}",
            f"{mode.hertz:.6g}", "–" if np.isnan(mode.damping_ratio) else _plain(mode.damping_ratio),
            _movers(mode.shape),
        )
        for k, mode in enumerate(linear.modes, start=1)
    ]  # fmt: skip
    heads = ("mode", "eigenvalue [1/s]", "ω [rad/s]", "f [Hz]", "damping ζ [-]", "motion")
    return table(head, heads, rows) + paragraphs(
        line.strip() for line in rest if line.startswith(("  states", "  inputs", "  outputs"))
    )


def _plain(ratio: float) -> str:
    """Four digits, without a sign before zero."""
    return f"{round(ratio, 4) + 0.0:.4f}"


def _movers(shape: Mapping[str, complex]) -> str:
    """The coordinates that move most, those out of phase with a sign."""
    parts = sorted(shape.items(), key=lambda item: -round(abs(item[1]), 9))
    shown = [(name, part) for name, part in parts if abs(part) >= 0.1]  # a tenth of the largest is worth naming
    words = [f"{'−' if part.real < 0.0 else ''}{name}" for name, part in shown[:MAX_NAMED]]
    return ", ".join(words + (["…"] if len(shown) > MAX_NAMED else [])) or "no coordinate"


def criteria_table(found: Criteria) -> str:
    """What was measured beside closed forms where they are known, then the spectra at some ω dt."""
    exact = found.exact
    titles = "measured" + ("" if exact is None else f"{'closed form':>22}")
    name = repr(found.integrator) + (f", oscillator with ξ = {found.damping_ratio:g}" if found.damping_ratio else "")
    if len(name) > 26:
        lines = [name, f"  {'':<32}{'':>14}{titles}"]
    else:
        lines = [f"{name:<34}{'':>14}{titles}"]
    entries = [
        ("order of consistency", f"{found.order:.2f}", exact and f"{exact.order}"),
        ("spectral radius at infinity", _radius(found.rho_inf), exact and _radius(exact.rho_inf)),
        ("stable up to ω dt", _limit(found.stability_limit),
         exact and ("–" if exact.stability_limit is None else _limit(exact.stability_limit))),
        ("damping ratio, ω dt → 0", _power(found.damping_coefficient, found.damping_order),
         exact and _power(exact.damping_coefficient, exact.damping_order)),
        ("period elongation, ω dt → 0", _power(found.elongation_coefficient, found.elongation_order),
         exact and _power(exact.elongation_coefficient, exact.elongation_order)),
    ]  # fmt: skip
    lines += [f"  {what:<32}{came:>22}" + (f"{wanted:>22}" if wanted else "") for what, came, wanted in entries]
    lines.append(f"  {'ω dt':>10} {'spectral radius':>16} {'damping ratio':>14} {'elongation':>11}")
    step = max(1, -(-len(found.spectra) // 11))
    for each in found.spectra[::step]:
        radius = "fails" if np.isnan(each.radius) else f"{each.radius:.9f}"
        lines.append(f"  {each.turn:>10.4g} {radius:>16} {_small(each.damping):>14} {_small(each.elongation):>11}")
    return "\n".join(lines)


def _radius(value: float) -> str:
    """Five digits behind the point: multiple roots are known to ε^⅓ only."""
    return f"{round(value, 5) + 0.0:.5g}"  # + 0.0: no minus before zero


def _small(value: float) -> str:
    return "–" if np.isnan(value) else f"{value:.3e}" if abs(value) > 1e-11 else "0"


def _limit(turn: float) -> str:
    return "always" if np.isinf(turn) else "never" if turn == 0.0 else f"{turn:.6g}"


def _power(coefficient: float, order: int) -> str:
    if np.isnan(coefficient):
        return "–"
    return f"{coefficient:.4g} (ω dt){str(order).translate(SUPERSCRIPTS) if order != 1 else ''}" if coefficient else "0"
