"""A motion that feeds itself is refused whichever joints are cut; what constraints leave of a step feeds nothing."""

import numpy as np
import pytest

import mbd
from tests.fuzz.scenes import scene
from tests.fuzz.verdict import run_of

SCHEMES = [mbd.HHT(0.05), mbd.HHT(0.05, formulation="index3"), mbd.GeneralizedAlpha(0.5), mbd.Newmark()]


@pytest.mark.parametrize("cut", ["auto", "all"])
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_a_turn_that_feeds_itself_is_refused_before_its_pole(scheme, cut):
    """``J ω̇ = c ω²`` has ω = ω₀/(1 − t/T) with T = J/(c ω₀)."""
    model = mbd.Model("fed", gravity=(0.0, 0.0, 0.0), cut=cut)
    arm = mbd.Link("arm", 1.0, 0.7, 0.4, 0.05)
    model.connect(mbd.Revolute("hinge", model.ground.origin, arm.start))
    inertia, speed, feed = 0.05 + 0.4**2, 2.0, 0.1
    model.apply(mbd.Motor("motor", model.joints[0], torque=lambda w: feed * w * w, arguments=("hinge.rate",)))
    pole = inertia / (feed * speed)
    for dt in (0.1 * pole, 0.02 * pole):
        start = mbd.assemble(model, velocity={"hinge.angle": speed})
        run = mbd.simulate(model, start, scheme, dt=dt, until=2.0 * pole, on_failure="return")
        assert not run.success
        assert run.time[-1] < pole + 2.0 * dt
        early = run.time < 0.5 * pole
        exact = speed / (1.0 - run.time[early] / pole)
        np.testing.assert_allclose(run["hinge.angle.rate"][early], exact, rtol=0.1)


@pytest.mark.parametrize("part", [1.0, 1.25, 1.5, 2.0, 3.0])
def test_short_steps_of_index_3_are_no_runaway(part):
    """A leg swings around a foot that sticks; a controller's samples cut steps short.

    Velocities off the constraints by the error of index 3 count for more the shorter a step is.
    """
    made = scene(26879)
    dt = made.options["dt"] / part
    run, fine = run_of(made, dt=dt, until=3.1), run_of(made, integrator=mbd.RadauIIA(), dt=5e-3, until=1.5)
    assert run.success, run.message
    early = run.time < 1.5
    for name in ("left hip.angle", "right hip.angle"):
        off = np.max(np.abs(run[name][early] - fine.at(run.time[early])[name]))
        assert off < 0.1, name
