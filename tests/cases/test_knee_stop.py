"""Cases h1 and h1b: a two-link leg whose knee runs into a spring and damper, with two release laws."""

from __future__ import annotations

import numpy as np
import pytest

import mbd
from mbd.integrators.family import NewmarkFamily
from tests.cases.schemes import SCHEMES, name_of
from tests.helpers import assert_second_order
from tests.problems import Case, case, knee_stop_events

CASES = {"gap": case("h1-knee-stop-gap-law"), "pull": case("h1b-knee-stop-unilateral")}
"""By the release rule: at d = 0 (the torque may pull just before), or as the torque would pull."""
SIZES = ("m1", "m2", "L1", "L2", "g")


def leg_model(m1: float, m2: float, L1: float, L2: float, g: float, k: float, c: float, release: str) -> mbd.Model:
    """Uniform rods that hang from a fixed hip; the knee's angle is the hyperextension d."""
    model = mbd.Model("leg", gravity=(0.0, -g, 0.0))
    thigh = mbd.Link("thigh", m1, length=L1, center=0.5 * L1, inertia=m1 * L1**2 / 12)
    shank = mbd.Link("shank", m2, length=L2, center=0.5 * L2, inertia=m2 * L2**2 / 12)
    knee = mbd.Revolute("knee", thigh.end, shank.start)
    model.connect(mbd.Revolute("hip", model.ground.origin, thigh.start), knee)
    model.constrain(
        mbd.Penalty("knee stop", mbd.flexion(knee), stiffness=k, damping=c, release=release),
        mbd.Event("deepest", mbd.measure("knee.rate", unit="rad"), direction=-1),
    )
    return model


def started(model: mbd.Model, theta1: float, theta2: float, w1: float = 0.0, w2: float = 0.0) -> mbd.State:
    return mbd.assemble(
        model,
        position={"hip.angle": theta1, "knee.angle": theta2 - theta1},
        velocity={"hip.angle": w1, "knee.angle": w2 - w1},
    )


def published(release: str) -> tuple[mbd.Model, mbd.State, Case]:
    reference = CASES[release]
    model = leg_model(*(reference.definition[name] for name in (*SIZES, "k", "c")), release=release)
    return model, started(model, *(reference.start[name] for name in ("theta1", "theta2", "w1", "w2"))), reference


def switches(run: mbd.Trajectory) -> list[float]:
    return [event.time for event in run.events if event.name == "knee stop"]


@pytest.mark.parametrize("release", CASES)
def test_the_stop_alone_takes_energy_and_only_between_its_switches(release: str) -> None:
    model, start, reference = published(release)
    until = reference["event times"].value[-1] + 0.05

    def error(dt: float) -> float:
        energy = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.9), dt=dt, until=until).energy
        assert set(energy.sums) == {"knee stop", "numerical"}
        return float(energy.sums["numerical"])

    assert_second_order(error, 1e-4)
    run = mbd.simulate(model, start, mbd.GeneralizedAlpha(0.9), dt=1e-4, until=until)
    open_ = np.ones(len(run), dtype=bool)
    for closes, opens in zip(switches(run)[::2], switches(run)[1::2], strict=True):
        open_ &= (run.time < closes) | (run.time > opens)
    assert np.all(run["knee stop.force"][open_] == 0.0)
    assert np.max(run["knee stop.force"]) > 200.0
    pulls = np.min(run["knee stop.force"])
    assert pulls < -20.0 if release == "gap" else pulls > -1e-6


@pytest.mark.parametrize("release", CASES)
def test_the_explicit_reference_agrees_with_the_published_instants(release: str) -> None:
    reference = CASES[release]
    sizes = tuple(reference.definition[name] for name in SIZES)
    first = [reference.start[name] for name in ("theta1", "theta2", "w1", "w2")]
    k, c = reference.definition["k"], reference.definition["c"]
    found = knee_stop_events(sizes, k, c, release == "gap", first, count=6)
    assert found == pytest.approx(reference["event times"].value, abs=1e-9)


@pytest.mark.parametrize("release", CASES)
@pytest.mark.parametrize("scheme", SCHEMES, ids=name_of)
def test_another_leg_with_a_softer_stop_switches_when_its_equations_say(scheme: NewmarkFamily, release: str) -> None:
    """Other masses, lengths, stop and start, against an explicit method with its own events."""
    sizes, k, c, first = (5.0, 4.1, 0.5, 0.37, 8.0), 1500.0, 9.0, (0.7, -0.2, -0.4, 1.1)
    model = leg_model(*sizes, k, c, release)
    start = started(model, *first)
    times = knee_stop_events(sizes, k, c, release == "gap", first, count=4)

    def errors(dt: float) -> list[float]:
        run = mbd.simulate(model, start, scheme, dt=dt, until=times[-1] + 0.02)
        return list(np.array(switches(run)) - times)

    assert_second_order(errors, 2e-4)
