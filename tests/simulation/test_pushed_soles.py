"""A foot on four corners below a heavy body that is pushed sideways: it tips, turns on a corner, slides, comes to rest.

Where a corner of a light foot begins to slide under a heavy load, friction would change its velocity in a step by far
more than the velocity is, so that the direction of sliding must be found by continuation.
"""

from __future__ import annotations

import numpy as np
import pytest

import mbd

G = 9.81


def pushed_foot(seed: int, grows: bool) -> tuple[mbd.Model, mbd.State]:
    """A foot of 1 kg on a sole of four corners, a body of up to 80 kg above its ankle, and a push from any side."""
    rng = np.random.default_rng(seed)
    model, mass = mbd.Model("foot"), rng.uniform(1.0, 80.0)
    foot = mbd.RigidBody("foot", 1.0, (0.003, 0.003, 0.001))
    model.connect(mbd.Free("float", model.ground.origin, foot.origin))
    length, width = rng.uniform(0.05, 0.15), rng.uniform(0.03, 0.08)
    corners = [foot.point(x, -0.08, z) for x in (-length, length) for z in (-width, width)]
    contacts = mbd.parts.polygon_foot(model, "sole", corners, friction=rng.uniform(0.2, 1.0))
    leg = rng.uniform(0.1, 0.8)
    body = mbd.RigidBody("body", mass, (0.02 * mass, 0.004 * mass, 0.02 * mass))
    stiffness, damping = mass * G * leg * rng.uniform(1.2, 4.0), mbd.Viscous(mass * rng.uniform(0.0, 0.1))
    ankle = mbd.Spherical("ankle", foot.origin, body.point(0.0, -leg, 0.0), stiffness=stiffness, loss=damping)
    model.connect(ankle)
    direction = rng.uniform(0.0, 2.0 * np.pi)
    size, frequency, height = rng.uniform(0.2, 1.5) * mass * G, rng.uniform(0.5, 5.0), rng.uniform(-0.1, 0.3)
    along = size * np.cos(direction), size * np.sin(direction)

    def push(t: float) -> tuple[float, float, float]:
        part = 2.0 * t if grows else mbd.sin(2.0 * np.pi * frequency * t)
        return along[0] * part, 0.0, along[1] * part

    model.apply(mbd.Applied("push", body.point(0.0, height, 0.0), arguments=("t",), force=push))
    return model, mbd.assemble(model, position={"float.y": 0.08}, closed=[contact.name for contact in contacts])


@pytest.mark.parametrize(
    ("seed", "grows", "scheme", "until"),
    [
        (1, True, mbd.HHT(0.05), 0.5),
        (7, False, mbd.RadauIIA(), 0.5),
        (23, False, mbd.HHT(0.05), 0.35),
        (73, True, mbd.RungeKutta853(), 0.45),
    ],
)
def test_a_pushed_foot_tips_and_slides_on_its_corners(seed, grows, scheme, until):
    """No step fails at the onset of sliding; events are those of another scheme with a quarter of the step."""
    model, start = pushed_foot(seed, grows)
    run = mbd.simulate(model, start, scheme, dt=2e-3, until=until)
    fine = mbd.simulate(model, start, mbd.RadauIIA(), dt=5e-4, until=until)
    early = [[(event.name, event.kind) for event in each.events[:7]] for each in (run, fine)]
    assert early[0] == early[1]
    assert [event.time for event in run.events[:7]] == pytest.approx(
        [event.time for event in fine.events[:7]], abs=1e-3
    )
    mu = next(value for name, value in model.parameters.items() if name.endswith(".mu"))
    for k in range(1, 5):
        push = run[f"sole corner {k}.force"]
        friction = np.hypot(run[f"sole corner {k}.friction.forward"], run[f"sole corner {k}.friction.sideways"])
        assert np.min(push) > -1e-6 * np.max(push) and np.all(friction <= mu * push + 1e-6 * np.max(push))
        assert np.max(np.diff(run.energy[f"sole corner {k} friction"])) <= 1e-9 * np.max(run.energy["kinetic"])


def test_switches_without_end_of_an_undamped_scheme_name_a_damped_one():
    """At 0.452 s this foot meets a Painlevé paradox, before which its force alternates with Newmark's scheme."""
    model, start = pushed_foot(105, False)
    run = mbd.simulate(model, start, mbd.Newmark(), dt=2e-3, until=0.5, on_failure="return")
    assert "at one instant" in run.message and "damps forces that alternate: take mbd.HHT(0.05)" in run.message


@pytest.mark.slow
@pytest.mark.parametrize("scheme", [mbd.HHT(0.05), mbd.GeneralizedAlpha(0.8), mbd.RadauIIA(), mbd.Newmark()], ids=str)
def test_pushed_feet_come_to_the_end_of_their_runs(scheme):
    """Seed 105 is left out: at 0.452 s it meets a Painlevé paradox."""
    for seed in (*range(100, 105), *range(106, 112)):
        model, start = pushed_foot(seed, seed % 2 == 0)
        assert mbd.simulate(model, start, scheme, dt=2e-3, until=0.5).success, seed
