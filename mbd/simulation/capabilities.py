"""What goes with what: one table of laws against integrators and strategies, held before the first step.

An integrator says itself what it cannot keep (`Integrator.check`). Every strategy treats every law; a test lets every
pair of the table run.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from mbd.dataclass import dataclass
from mbd.equations.equations import Equations
from mbd.errors import quoted
from mbd.integrators import KINDS, Integrator


@dataclass(frozen=True)
class Law:
    """A kind of constraint, contact or friction: the names of the parts of a model that follow it.

    holds : whether its rows hold positions
    """

    title: str
    parts: Callable[[Any, Equations], list[str]]
    holds: bool = False


def _rows(velocity: bool) -> Callable[[Any, Equations], list[str]]:
    def found(model: Any, equations: Equations) -> list[str]:
        free = [row for row in equations.rows if row.contact < 0 and row.friction < 0]
        return [row.owner for row in free if row.is_velocity == velocity]

    return found


def _contacts(chosen: Callable[[Any], Any]) -> Callable[[Any, Equations], list[str]]:
    return lambda model, equations: [contact.name for contact in equations.contacts if chosen(contact)]


def _frictions(of_contact: bool) -> Callable[[Any, Equations], list[str]]:
    return lambda model, equations: [f.name for f in equations.frictions if (f.contact >= 0) == of_contact]


LAWS: tuple[Law, ...] = (
    Law("rows on positions", _rows(False), holds=True),
    Law("rows on velocities", _rows(True)),
    Law("Unilateral", _contacts(lambda contact: contact.kind == "unilateral"), holds=True),
    Law("release=When", _contacts(lambda contact: contact.when), holds=True),
    Law("friction=μ", _frictions(True), holds=True),
    Law("Penalty", _contacts(lambda contact: contact.kind == "penalty")),
    Law("dry friction of joints", _frictions(False)),
    Law("Event", lambda model, equations: [guard.name for guard in equations.guards]),
    Law("Controller", lambda model, equations: [c.name for c in getattr(model, "controllers", ())]),
)
"""Laws by the words that users know them by; a loop, and a joint with `PinFriction`, gives rows on positions."""

SCHEMES: dict[str, tuple[Integrator, ...]] = {}
for _kind in KINDS:
    for _column, _schemes in _kind.examples().items():
        SCHEMES[_column] = (*SCHEMES.get(_column, ()), *_schemes)
"""Columns of the table: schemes that stand for all with this formulation."""

STRATEGIES: tuple[Mapping[str, str], ...] = (
    {"contact": "events"}, {"contact": "nonsmooth"}, {"impact": "newton"}, {"impact": "poisson"},
    {"impact": "sequential"}, {"locate": "linear"},
)  # fmt: skip
"""Further columns: arguments of `simulate`."""

TOGETHER: dict[tuple[tuple[str, str], tuple[str, str]], str] = {
    (("contact", "nonsmooth"), ("locate", "linear")): (
        "contact='nonsmooth' does not locate contacts, and locate='linear' would locate all else roughly; use "
        "locate='root', or contact='events'"
    ),
}
"""Pairs of arguments that exclude each other."""

CHARTED_JOINTS = "joints whose coordinates do not add, such as those of free rotations, have not"
"""Why a scheme that knows vectors only is refused."""

WITH_TOLERANCE: dict[tuple[str, str], str] = {
    ("contact", "nonsmooth"): (
        "contact='nonsmooth' takes fixed steps, of first order at impacts, which follow no tolerance; use "
        "contact='events', or dt="
    ),
    ("locate", "linear"): "locate='linear' leaves errors of event instants that tol= does not see; use locate='root'",
}
"""Arguments that exclude tol=."""

SPACE: dict[str, str] = {
    "Rolling without axis= or ball=": "axis= of a disk, ball=True of a sphere, or mbd.Nonholonomic rows",
}
"""What is solved in planar models only, and what to use in space instead; refused as the equations are derived."""


def supports(law: Law, scheme: Integrator) -> bool:
    """Whether a scheme says that it can integrate rows as this law has them."""
    return scheme.check(int(law.holds)) is None


def refusals(equations: Equations, scheme: Integrator, options: Mapping[str, Any]) -> list[str]:
    """Every pair of a run that is not supported, each named with what to use instead."""
    found = [text for pair, text in TOGETHER.items() if all(options.get(name) == value for name, value in pair)]
    held = [row.owner for row in equations.rows if not row.is_velocity]
    texts = [scheme.check(len(held))]
    if options.get("tol") is not None:
        texts.append(scheme.check_tolerance(len(held)))
        found += [text for (argument, value), text in WITH_TOLERANCE.items() if options.get(argument) == value]
    found += [f"{text} (rows on positions: {quoted(held, 4)})" if held else text for text in texts if text]
    if equations.impulses and options.get("contact") == "nonsmooth":
        found.append(
            f"contact='nonsmooth' locates no strike at which {quoted([each.name for each in equations.impulses], 4)} "
            "could act; use contact='events'"
        )
    if equations.compose is not None and not scheme.any_chart:
        found.append(f"{scheme!r} moves coordinates along q + x, which {CHARTED_JOINTS}; use mbd.HHT(0.05)")
    return found


def _cells() -> list[list[str]]:
    """The table: its head, and a row for each law."""
    rows = [["", *SCHEMES, *(f"{argument}={value}" for column in STRATEGIES for argument, value in column.items())]]
    for law in LAWS:
        cells = [all(supports(law, scheme) for scheme in schemes) for schemes in SCHEMES.values()]
        cells += [True for column in STRATEGIES for _ in column]
        rows.append([law.title, *("yes" if cell else "no" for cell in cells)])
    return rows


def _others() -> list[str]:
    """What is refused besides, a line each."""
    lines = [f"in space, {what}: use {instead}" for what, instead in SPACE.items()]
    for (argument, value), text in WITH_TOLERANCE.items():
        lines.append(f"tol= with {argument}={value!r}: {text.partition('; ')[2]}")
    lines.append(
        "tol= with index 3 where rows hold positions, or with a scheme of first order: formulation='ggl', or dt="
    )
    for pair, text in TOGETHER.items():
        both = " with ".join(f"{name}={value!r}" for name, value in pair)
        lines.append(f"{both}: {text.partition('; ')[2]}")
    return lines


def as_markdown() -> str:
    """The table as it stands in the documentation."""
    head, *body = _cells()
    lines = [f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *body)]
    return "\n".join([*lines, "", "Also refused:", "", *(f"- {line}" for line in _others())])


def as_text() -> str:
    """The table in words for a terminal: what is supported, and each exception on a line."""
    head, *body = _cells()
    lines = ["Every integrator and option supports every kind of constraint, contact and controller, except:"]
    for number, column in enumerate(head[1:], 1):
        refused = [row[0] for row in body if row[number] == "no"]
        lines += [f"  {column}: no {', '.join(refused)}"] if refused else []
    return "\n".join([*lines, *(f"  {line}" for line in _others())])
