"""A point whose foot sticks where it strikes, and bounces over a saddle (g7)."""

from functools import cache
from typing import Any

import numpy as np

import mbd
from mbd.hardcases.case import ROUND_OFF, Curve, Figure, Outcome, hard_case
from mbd.hardcases.impacts import deepest, impact_figures
from mbd.hardcases.references import accuracy, numbers, published, size


@cache
def point(m: float, g: float, e: float, along: float, across: float, twist: float) -> mbd.Model:
    """A point mass over y = (H_xx x² + H_zz z²)/2 + H_xz x z."""

    def saddle(x: Any, z: Any) -> Any:
        return 0.5 * (along * x * x + across * z * z) + twist * x * z

    model = mbd.Model("point", gravity=(0.0, -g, 0.0))
    body = mbd.PointMass("point", mass=m)
    model.connect(mbd.Translation("place", model.ground.origin, body.origin, axes="xyz"))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(body.origin, saddle), restitution=e))
    return model


def bounces(id: str, scheme: Any) -> Outcome:
    """Instants, states and impulses of the impacts, by each law."""
    given = numbers(id)
    model = point(*(float(given[name]) for name in ("m", "g", "e", "H_xx", "H_zz", "H_xz")))
    start = mbd.assemble(
        model,
        position={f"place.{axis}": value for axis, value in zip("xyz", given["place"], strict=True)},
        velocity={f"place.{axis}": value for axis, value in zip("xyz", given["velocity"], strict=True)},
    )
    times = published(id, "impact times")
    figures: list[Figure] = []
    for law in ("newton", "poisson", "sequential"):
        run = mbd.simulate(model, start, scheme, dt=0.01, until=1.001 * times[-1], impact=law)
        figures += [Figure(f"{law} law: {each.what}", each.value, each.limit) for each in errors(id, run)]
        figures += impact_figures(model, run)
    figures.append(Figure("penetration [m]", deepest(run), 1e-10))
    return Outcome(figures, [Curve("height of the foot over the ground", run.time, run["foot.gap"], y_label="gap [m]")])


def errors(id: str, run: Any) -> list[Figure]:
    """Errors at the impacts, relative to the largest value of each kind."""
    events = [event for event in run.events if event.kind == "closed"]
    rows = [event.row for event in events]
    found = {
        "impact times": np.array([event.time for event in events]),
        "[x, y, z, vx, vy, vz]": np.stack(
            [run[f"place.{axis}{rate}"][rows] for rate in ("", ".rate") for axis in "xyz"], axis=1
        ),
        "impulses": np.array([event.impulse for event in events]),
    }
    figures = []
    for name, values in found.items():
        wanted = published(id, name)
        off = size(values - wanted) if values.shape == wanted.shape else float("nan")
        most = max(ROUND_OFF * size(wanted), 10.0 * accuracy(id, name))
        figures.append(Figure(f"error of {name} over the limit [-]", off / most, 1.0))
    return figures


CASES = (
    hard_case(
        "g7-sticking-foot-on-a-saddle",
        "A sticking foot leaves along the normal of the place that it strikes, by every law, with the impulse of it.",
        bounces,
    ),
)
