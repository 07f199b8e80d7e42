"""Newton's cradle: balls in a row that all touch (g2, g2b)."""

from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

import mbd
from mbd.equal import ROUND_OFF_RTOL
from mbd.hardcases.case import Curve, Figure, Outcome, hard_case
from mbd.hardcases.impacts import deepest, difference, impact_figures
from mbd.hardcases.references import accuracy, numbers, published, size
from mbd.simulation.arguments import CHOICES

LAWS = {
    "newton": "velocities, simultaneous Newton (Moreau) law",
    "sequential": "velocities, sequential (pairwise, repeated) law",
}
"""The reference of each impact law, by the word that `simulate` takes; those that it knows are judged."""


@cache
def row(masses: tuple[float, ...], e: float, turned: bool = False) -> mbd.Model:
    """Balls on a rail, whose places are measured so that touching ones have the same."""
    model = mbd.Model("cradle", gravity=(0.0, 0.0, 0.0))
    for k, m in enumerate(masses):
        body = mbd.PointMass(f"ball {k}", mass=m)
        model.connect(mbd.Prismatic(f"place {k}", model.ground.origin, body.origin))
    contacts = [
        mbd.Unilateral(
            f"touch {k}",
            mbd.measure(lambda a, b: b - a, f"place {k}.displacement", f"place {k + 1}.displacement"),
            restitution=e,
        )
        for k in range(len(masses) - 1)
    ]
    model.constrain(*(contacts[::-1] if turned else contacts))
    return model


def collide(model: mbd.Model, speeds: Sequence[float], scheme: Any, impact: str, named: bool = True) -> Any:
    """Balls that approach each other all meet after 1 s; equally fast neighbours touch, `named` as closed or not."""
    places = [0.0]
    for a, b in pairwise(speeds):
        places.append(places[-1] + max(a - b, 0.0))
    touching = [f"touch {k}" for k, (a, b) in enumerate(pairwise(speeds)) if a == b]
    start = mbd.assemble(
        model,
        position={f"place {k}.displacement": x for k, x in enumerate(places)},
        velocity={f"place {k}.displacement": v for k, v in enumerate(speeds)},
        closed=touching if named else [],
    )
    words: Any = {"impact": impact}
    return mbd.simulate(model, start, scheme, dt=0.07, until=2.0, **words)


def law_figures(id: str, law: str, scheme: Any) -> tuple[list[Figure], Any]:
    """What holds under one impact law, and the run."""
    given = numbers(id)
    masses, speeds, e = tuple(map(float, given["masses"])), [float(v) for v in given["v"]], float(given["e"])
    model = row(masses, e)
    run, other = (collide(row(masses, e, turned), speeds, scheme, law) for turned in (False, True))
    reference = published(id, LAWS[law])
    final = run.record.v[-1]
    momentum = run.record.v @ np.array(masses)
    kinetic = run.energy.kinetic
    scale = published(id, "momentum")
    unnamed = collide(model, speeds, scheme, law, named=False).record.v[-1]
    figures = [
        Figure("error of the velocities after [m/s]", size(final - reference), accuracy(id, LAWS[law])),
        Figure(
            "error of them where touching balls are not named as closed [m/s]",
            size(unnamed - reference), accuracy(id, LAWS[law]),
        ),
        Figure("change of momentum, relative [-]", size(momentum / scale - 1.0), ROUND_OFF_RTOL),
        Figure(
            "error of the energy before, relative [-]",
            abs(kinetic[0] / published(id, "kinetic energy before") - 1.0), ROUND_OFF_RTOL,
        ),
        Figure("kinetic energy gained, relative [-]", float(np.max(np.diff(kinetic))) / kinetic[0], ROUND_OFF_RTOL),
        Figure("penetration [m]", deepest(run), 1e-10),
    ]  # fmt: skip
    if law == "newton":
        figures += [
            Figure("change with the order of the contacts, relative [-]", difference(run, other), ROUND_OFF_RTOL),
            *impact_figures(model, run),
        ]
    else:
        turned = other.record.v[-1]
        figures.append(
            Figure("change with the order of the contacts [m/s]", size(final - turned), accuracy(id, LAWS[law]))
        )
    return [Figure(f"{law} law: {each.what}", each.value, each.limit) for each in figures], run


def struck(id: str, scheme: Any) -> Outcome:
    """Each impact law gives its own outcome, with the momentum that came in and no more energy."""
    figures: list[Figure] = []
    curves = []
    for law in [each for each in LAWS if each in CHOICES["impact"]]:
        found, run = law_figures(id, law, scheme)
        figures += found
        count = len(numbers(id)["masses"])
        curves += [Curve(f"velocities after, {law} law", np.arange(count), run.record.v[-1], "ball", "velocity [m/s]")]
    return Outcome(figures, curves)


CASES = (
    hard_case(
        "g2-newtons-cradle",
        "The outcome is that of the impact law in use, with the momentum that came in and no energy gained.",
        struck,
    ),
    hard_case(
        "g2b-newtons-cradle-2in",
        "Two balls in: the outcome is that of the impact law in use, whichever contact is named first.",
        struck,
    ),
)
