"""A joint with dry friction at its stop: friction comes off its limit as the stop opens, within less than a step."""

import math

import numpy as np
import pytest

import mbd

SCHEMES = (mbd.HHT(), mbd.GeneralizedAlpha(0.8), mbd.RadauIIA(), mbd.RungeKutta853(), mbd.RungeKutta4())


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda scheme: type(scheme).__name__)
@pytest.mark.parametrize("dt", [5e-3, 2e-3])
def test_it_sticks_until_the_torque_passes_the_other_limit(scheme, dt):
    """Pressed by a torque τ = a cos ωt: the stop opens at τ = μ with friction at that limit, sliding begins at −μ."""
    rng = np.random.default_rng(8)
    for _ in range(6):
        friction, size, frequency = rng.uniform(0.1, 1.0), rng.uniform(10.0, 30.0), rng.uniform(10.0, 60.0)
        model = mbd.Model("arm", gravity=(0.0, 0.0, 0.0))
        arm = mbd.Link("arm", mass=3.5, length=0.43, center=0.2, inertia=0.06)
        joint = mbd.Revolute("joint", model.ground.origin, arm.start, loss=mbd.Coulomb(friction))
        model.connect(joint)
        model.constrain(mbd.Unilateral("stop", mbd.flexion(joint)))

        def torque(t, size=size, frequency=frequency):
            return size * mbd.cos(frequency * t)

        model.apply(mbd.Motor("servo", joint, torque=torque, arguments=("t",)))
        start = mbd.assemble(model, position={"joint.angle": 0.0}, closed=["stop"])
        opens, slides = (math.acos(sign * friction / size) / frequency for sign in (1.0, -1.0))
        end = slides + 0.5 / frequency
        run = mbd.simulate(model, start, scheme, dt=dt, until=end)
        found = [(event.name, event.kind) for event in run.events]
        assert found == [("stop", "opened"), ("joint", "stuck"), ("joint", "slipped")]
        times = [event.time for event in run.events]
        assert times == pytest.approx([opens, opens, slides], rel=1e-9)
        inertia = 0.06 + 3.5 * 0.2**2
        gained = size / frequency * (math.sin(frequency * end) - math.sin(frequency * slides)) + friction * (
            end - slides
        )
        assert run["joint.angle.rate"][-1] == pytest.approx(gained / inertia, rel=1e-2)
