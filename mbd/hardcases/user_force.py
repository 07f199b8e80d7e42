"""A user's force that stops being a number: j16."""

import math
import re
from typing import Any

import numpy as np

import mbd
from mbd.dataclass import dataclass
from mbd.hardcases.case import Curve, Figure, HardCase, Outcome, definition
from mbd.hardcases.references import quantity, size
from mbd.hardcases.schemes import EVERY

J16 = "j16-nan-user-force"
STEPS = (0.01, 0.003, 0.0007)
"""One that ends at the instant of the fault and two that step over it [s]."""


@dataclass(frozen=True)
class Push:
    """A mass [kg], the force on it [N] and the time from which it is NaN [s], as the definition says them."""

    mass: float
    force: float
    until: float


def push(case: str = J16) -> Push:
    """Read from 'free particle m = 1 kg, F(t) = 1 N for t < 0.5 s, NaN afterwards'."""
    words = definition(case)["definition"]["model"]
    found = re.search(r"m = ([\d.]+) kg, F\(t\) = ([\d.]+) N for t < ([\d.]+) s", words)
    assert found is not None, words
    return Push(*map(float, found.groups()))


def pushed_particle() -> tuple[mbd.Model, mbd.State]:
    """A free particle under a steady force 'push' that is NaN from a time on."""
    begin, given = definition(J16)["initial_conditions"], push(J16)
    model = mbd.Model("particle", gravity=(0.0, 0.0, 0.0))
    body = mbd.PointMass("particle", given.mass)
    model.connect(mbd.Translation("place", model.ground.origin, body.origin))
    fault = mbd.Applied("push", body.origin, force=lambda t: (mbd.where(t < given.until, given.force, math.nan), 0.0))
    model.apply(fault)
    return model, mbd.assemble(model, position={"place.x": begin["x"]}, velocity={"place.x": begin["v"]})


def judge_nan(integrator: Any) -> Outcome:
    """The run stops at the fault, whatever dt, names force, time and body, and keeps all before it."""
    given, last, begin = push(), quantity(J16, "x and v"), definition(J16)["initial_conditions"]
    fault, rise = given.until, given.force / given.mass
    model, start = pushed_particle()
    quiet, unnamed, late, beyond, off, bad = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for dt in STEPS:
        try:
            run = mbd.simulate(model, start, integrator, dt=dt, until=2.0 * fault)
            quiet += 1.0
        except mbd.SimulationError as error:
            run = error.run
            words = (f"t = {fault:.9g} s", "'push'", "particle", "not finite")
            unnamed += sum(word not in str(error) for word in words)
        kept = float(run.time[-1])
        late = max(late, abs(kept - fault))
        ahead, x, v = fault - kept, float(run["place.x"][-1]), float(run["place.x.rate"][-1])
        carried = np.array([x + v * ahead + 0.5 * rise * ahead**2, v + rise * ahead])
        beyond = max(beyond, size(carried - last.value))
        t = run.time
        place, speed = begin["x"] + begin["v"] * t + 0.5 * rise * t**2, begin["v"] + rise * t
        off = max(off, *(size(error) for error in (run["place.x"] - place, run["place.x.rate"] - speed)))
        record = run.record
        bad += sum(int(np.count_nonzero(~np.isfinite(part))) for part in (record.q, record.v, record.a, record.time))
    return Outcome(
        [
            Figure("runs that go on", quiet, 0),
            Figure("words missing in the error: time, force, body", unnamed, 0),
            Figure("end of the run off the fault by [s]", late, 1e-12),
            Figure("error of place and speed carried on to the fault [m, m/s]", beyond, last.accuracy),
            Figure("error of place and speed [m, m/s]", off, last.accuracy),
            Figure("numbers kept that are none", bad, 0),
        ],
        [Curve("place until the fault", run.time, run["place.x"], y_label="x [m]")],
    )


CASES = (
    HardCase(J16, "The run stops at the fault, names force, time and body, and keeps what it has.", judge_nan, EVERY),
)
