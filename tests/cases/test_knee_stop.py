"""The leg of the hard cases h1 and h1b with other numbers: its knee runs into a spring and damper."""

import numpy as np
import pytest

import mbd
from mbd.hardcases.knees import leg
from mbd.integrators.family import NewmarkFamily
from tests.cases.schemes import SCHEMES, name_of
from tests.helpers import assert_second_order
from tests.problems import case, knee_stop_events

CASES = {"gap": case("h1-knee-stop-gap-law"), "pull": case("h1b-knee-stop-unilateral")}
"""By the release rule: at d = 0 (the torque may pull just before), or as the torque would pull."""
SIZES = ("m1", "m2", "L1", "L2", "g")


def started(model: mbd.Model, theta1: float, theta2: float, w1: float = 0.0, w2: float = 0.0) -> mbd.State:
    return mbd.assemble(
        model,
        position={"hip.angle": theta1, "knee.angle": theta2 - theta1},
        velocity={"hip.angle": w1, "knee.angle": w2 - w1},
    )


def switches(run: mbd.Trajectory) -> list[float]:
    return [event.time for event in run.events if event.name == "knee stop"]


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
    m1, m2, L1, L2, g = sizes
    model = leg((m1, m2), (L1, L2), g, k, c, release)
    start = started(model, *first)
    times = knee_stop_events(sizes, k, c, release == "gap", first, count=4)

    def errors(dt: float) -> list[float]:
        run = mbd.simulate(model, start, scheme, dt=dt, until=times[-1] + 0.02)
        return list(np.array(switches(run)) - times)

    assert_second_order(errors, 2e-4)
