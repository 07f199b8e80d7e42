"""An oscillator that grazes a wall (j7)."""

from __future__ import annotations

import math
import re
from functools import cache
from typing import Any

import numpy as np

import mbd
from mbd.dataclass import dataclass
from mbd.hardcases.case import Curve, Figure, Outcome, definition, hard_case
from mbd.hardcases.convergence import second_order
from mbd.hardcases.impacts import deepest
from mbd.hardcases.references import accuracy, numbers, published, size


@cache
def oscillator(m: float, w: float, place: float | None, e: float) -> mbd.Model:
    """A mass on a spring; the wall is at x = place, None without it."""
    model = mbd.Model("oscillator", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("mass", mass=m)
    model.connect(mbd.Prismatic("slide", model.ground.origin, body.origin, stiffness=m * w * w))
    if place is not None:
        model.constrain(mbd.Unilateral("wall", mbd.measure(lambda x: place - x, "slide.displacement"), restitution=e))
    return model


def offsets(id: str) -> dict[float, str]:
    """How far the walls of the references are inside of the amplitude, over d, with the names of the references."""
    names = [each["name"] for each in definition(id)["quantities"]]
    found = {name: re.match(r"wall at d\(1 - (.*?)\):", name) for name in names}
    return {float(match[1]): name for name, match in found.items() if match}


def graze(id: str, scheme: Any, dt: float, offset: float | None) -> Any:
    """Half a period from x = 0."""
    given = numbers(id)
    w, m = float(given["w"]), float(given.get("m", 1.0))
    place = None if offset is None else float(given["d"]) * (1.0 - offset)
    model = oscillator(m, w, place, float(given.get("e", 1.0)))
    start = mbd.assemble(
        model, position={"slide.displacement": given["x"]}, velocity={"slide.displacement": float(given["v"])}
    )
    return mbd.simulate(model, start, scheme, dt=dt, until=math.pi / w)


@dataclass(frozen=True)
class Course:
    """A scheme's motion without a wall, with one step.

    dt : step [s]
    error : how far its turning point is from A [m]
    delay : how much later it is reached than after a quarter of a period [s]
    """

    dt: float
    error: float
    delay: float

    @classmethod
    def of(cls, id: str, scheme: Any, dt: float) -> Course:
        """Measured with the interpolation of the run, as finely as round-off allows."""
        given = numbers(id)
        quarter = 0.5 * math.pi / float(given["w"])
        times = quarter + np.linspace(-3.0, 3.0, 12001) * dt
        x = graze(id, scheme, dt, None).at(times)["slide.displacement"]
        top = int(np.argmax(x))
        return cls(dt, abs(float(x[top]) - float(given["A"])), float(times[top] - quarter))


def graze_figures(id: str, offset: float, name: str, courses: list[Course], runs: list[Any]) -> list[Figure]:
    """A wall inside of the amplitude is found as soon as the turning point is accurate enough, another never."""
    given = numbers(id)
    A, w, d = (float(given[each]) for each in ("A", "w", "d"))
    m, e = float(given.get("m", 1.0)), float(given.get("e", 1.0))
    depth, force = A - d * (1.0 - offset), A * w * w
    hits = [[event for event in run.events if event.impulse.any()] for run in runs]
    over = []
    for course, each in zip(courses, hits, strict=True):
        # a motion whose turning point is off by δ gets at most depth + δ behind the wall; its ẍ is off by (ω dt)²/12
        speed = math.sqrt(2.0 * force * max(depth + course.error, 0.0)) * (1.0 + (w * course.dt) ** 2)
        over.append(size([event.impulse[0] for event in each]) - m * (1.0 + e) * speed)
    title = f"wall at d(1 − {offset:g})"
    figures = [
        Figure(f"{title}: impulse above m √(2|ẍ|δ)(1+e) [N s]", float(np.max(over)), 1e-12 * m * A * w),
        Figure(f"{title}: impacts more than one [-]", max(len(each) for each in hits) - 1.0, 0.0),
        Figure(f"{title}: penetration [m]", float(np.max([deepest(run) for run in runs])), 1e-10),
    ]
    if np.ndim(published(id, name)) == 0:  # a number of impacts: none, for a wall that the motion does not reach
        count = published(id, name)
        clear = [abs(len(each) - count) for each, course in zip(hits, courses, strict=True) if course.error < -depth]
        return [*figures, Figure(f"{title}: impacts though the motion stays clear of it [-]", sum(clear), 0.0)]
    able = [(c, run, each) for c, run, each in zip(courses, runs, hits, strict=True) if 2.0 * c.error < depth]
    time, speed = published(id, name)
    late, slow = [], []
    for course, run, each in [one for one in able if one[2]]:
        off = course.error / speed
        before = run["slide.rate"][each[0].row - 1]
        grain = 1e-3 * course.dt  # of the search for the turning point
        late.append(abs(each[0].time - time) / (2.0 * off + 2.0 * abs(course.delay) + grain + accuracy(id, name)))
        slow.append(abs(before - speed) / (2.0 * force * off + speed * (w * course.dt) ** 2 + accuracy(id, name)))
    return [
        *figures,
        Figure(f"{title}: missed at steps that can find it [-]", sum(not each for _, _, each in able), 0.0),
        Figure(f"{title}: error of the time over what δ allows [-]", size(late) if late else math.nan, 1.0),
        Figure(f"{title}: error of the speed over what δ allows [-]", size(slow) if slow else math.nan, 1.0),
    ]


def grazing(id: str, scheme: Any) -> Outcome:
    """Walls just inside, at, and just outside of the amplitude, over steps from T/100 until all can be found."""
    inside = [offset for offset in offsets(id) if offset > 0.0]
    least = min(inside) * float(numbers(id)["d"])
    courses = [Course.of(id, scheme, 0.02 * math.pi / float(numbers(id)["w"]))]
    # of T/100: a scheme of order 2 is off by 1e-12 then
    while len(courses) < 4 or (not courses[-1].error < 0.4 * least and len(courses) < 16):
        courses.append(Course.of(id, scheme, 0.5 * courses[-1].dt))
    figures = [Figure("δ at the finest step over the least depth [-]", courses[-1].error / least, 0.4)]
    steps, deltas = ([getattr(course, part) for course in courses] for part in ("dt", "error"))
    curves = [Curve("δ, the error of the turning point", steps, deltas, "step [s]", "error [m]", True)]
    for offset, name in offsets(id).items():
        runs = [graze(id, scheme, dt, offset) for dt in steps]
        figures += graze_figures(id, offset, name, courses, runs)
        if offset == max(inside):
            time = published(id, name)[0]
            errors = [size([event.time - time for event in run.events[:1]] or [math.nan]) for run in runs[:4]]
            what = f"the contact time at d(1 − {offset:g}) [s]"
            figures += second_order(f"error of {what}", steps[:4], errors, 1e-4 * time, accuracy(id, name),
                                    order=scheme.order())  # fmt: skip
            place = runs[0]["slide.displacement"]
            curves.append(Curve(f"motion, wall at d(1 − {offset:g})", runs[0].time, place, y_label="x [m]"))
    return Outcome(figures, curves[::-1])


CASES = (
    hard_case(
        "j7-grazing-contact",
        "A graze is found as soon as the motion is more accurate than it is deep; a tangent touch gives no impulse.",
        grazing,
    ),
)
