"""Motions within the chart of a step, as expressions: where coordinates do not add (see `mbd.configuration`)."""

from typing import Any

from mbd.tape.derivatives import jvp, substitute
from mbd.tape.node import Node, Scalar, Tape


def chart_maps(equations: Any) -> tuple[tuple[Node, ...], ...]:
    """q ⊕ x | other ⊖ q | ẋ by x, v | v by x, ẋ in the place of v | ẍ by x, v, v̇ | v̇ by x, ẋ, ẍ in those of v, v̇.

    The other q stands in the inputs ('q', n_q + k), v̇ in ('a', k).
    """
    tape, configuration = equations.tape, equations.configuration
    with tape.lock:
        n_q, n_v = equations.n_q, equations.n_v
        q, x, v = (_inputs(tape, kind, n) for kind, n in (("q", n_q), ("x", n_v), ("v", n_v)))
        other = [tape.input("q", n_q + k) for k in range(n_q)]
        moved = [b - a for a, b in zip(q, other, strict=True)]
        difference = [moved[k] if k >= 0 else tape.zero for k in configuration.places]
        velocities = list(v)
        for joint, first_q, first_v in configuration.charts:
            here, own = slice(first_q, first_q + len(joint.labels)), slice(first_v, first_v + len(joint.freedoms))
            difference[own] = [tape.lift(value) for value in joint.difference(q[here], other[here])]
            velocities[own] = [tape.lift(value) for value in joint.increment_velocities(x[own], v[own])]
        rates = v if equations.chart is None else equations.chart.rates
        a = dict(zip(v, _inputs(tape, "a", n_v), strict=True))
        seeds: dict[Node, Scalar] = {**dict(zip(x, rates, strict=True)), **a}
        accelerations, turned = jvp(rates, seeds), jvp(velocities, {**dict(zip(x, v, strict=True)), **a})
        parts = (equations.compose, difference, rates, velocities, accelerations, turned)
        return tuple(tuple(part) for part in parts)


def chart_end(equations: Any) -> list[Node]:
    """x | ẋ | ẍ (n_v each) in the chart around q of the state (q', v, v̇), by the numbers q | q' | v | v̇."""
    n_q, n_v, tape = equations.n_q, equations.n_v, equations.tape
    _, difference, rates, _, accelerations, _ = chart_maps(equations)
    held = [tape.input("held", k) for k in range(2 * n_q + 2 * n_v)]
    known: dict[Node, Scalar] = dict(zip(_inputs(tape, "q", 2 * n_q), held, strict=False))
    x = substitute(difference, known)
    known |= dict(zip(_inputs(tape, "x", n_v), x, strict=True))
    known |= dict(zip(_inputs(tape, "v", n_v), held[2 * n_q :], strict=False))
    known |= dict(zip(_inputs(tape, "a", n_v), held[2 * n_q + n_v :], strict=True))
    return [*x, *substitute([*rates, *accelerations], known)]


def chart_motion(equations: Any) -> list[Node]:
    """v | v̇ (n_v each) by the numbers x | ẋ | ẍ."""
    n_v, tape = equations.n_v, equations.tape
    *_, velocities, _, turned = chart_maps(equations)
    letters = [node for kind in "xva" for node in _inputs(tape, kind, n_v)]
    return substitute([*velocities, *turned], {node: tape.input("held", k) for k, node in enumerate(letters)})


def _inputs(tape: Tape, kind: str, size: int) -> list[Node]:
    return [tape.input(kind, k) for k in range(size)]
