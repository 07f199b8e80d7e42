"""Laws that read forces of constraints, contacts and joints: solved with them, sampled, or refused by name."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import mbd
from mbd.joints.losses.base import Loss
from tests.helpers import one_body
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start

HUB, ARM, ARM_LENGTH, INERTIA, GRAVITY = 2.0, 1.0, 0.25, 0.02, 9.81
ABOUT_PIN = INERTIA + ARM * ARM_LENGTH**2
SCHEMES = [
    (mbd.RungeKutta853(), 5e-3, 1e-11), (mbd.RungeKutta4(), 1e-3, 1e-10), (mbd.RadauIIA(), 2.5e-3, 1e-11),
    (mbd.HHT(0.05), 1e-3, 5e-6), (mbd.GeneralizedAlpha(0.8), 1e-3, 5e-6),
]  # fmt: skip
LAWS = {
    "a part of the load": lambda load: 0.02 * load,
    "less than the load": lambda load: -0.05 * load,
    "saturating": lambda load: 0.06 * load / (1.0 + (load / 30.0) ** 2),
    "a root": lambda load: 0.1 * (load * load + 1.0) ** 0.5,
}


def arm_on_a_hub(torque=0.0, reads=(), loss=None, others=(), cut="auto"):
    """A pendulum on a hub that stands on a sticking foot; a motor in its pin."""
    model = mbd.Model("arm on a hub", cut=cut)
    hub = mbd.RigidBody("hub", mass=HUB, inertia=0.1)
    arm = mbd.Link("arm", mass=ARM, length=0.5, center=ARM_LENGTH, inertia=INERTIA)
    hinge = mbd.Revolute("hinge", hub.origin, arm.start, loss=loss)
    model.connect(mbd.Planar("float", model.ground.origin, hub.origin), hinge)
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(hub.origin)))
    model.constrain(mbd.Bilateral("upright", mbd.measure(lambda angle: angle, "float.angle")))
    model.apply(mbd.Motor("drive", hinge, torque=torque, arguments=list(reads)))
    if others:
        model.apply(*others)
    return model


def stands(model, angle=0.3):
    return mbd.assemble(model, {"float.y": 0.0, "hinge.angle": angle}, closed="foot")


def load_and_acceleration(angle, rate, law):
    """N = (M + m) g + m c (θ̈ sin θ + θ̇² cos θ) and J θ̈ = −m g c sin θ + law(N)."""

    def acceleration(load):
        return (-ARM * GRAVITY * ARM_LENGTH * math.sin(angle) + law(load)) / ABOUT_PIN

    def missing(load):
        lift = acceleration(load) * math.sin(angle) + rate * rate * math.cos(angle)
        return (HUB + ARM) * GRAVITY + ARM * ARM_LENGTH * lift - load

    load = brentq(missing, -1e4, 1e4, xtol=1e-14, rtol=1e-15)
    return load, acceleration(load)


def swing(law, angle, rate, seconds):
    def slope(t, y):
        return [y[1], load_and_acceleration(*y, law)[1]]

    return solve_ivp(slope, (0.0, seconds), [angle, rate], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_a_law_and_the_load_it_reads_are_solved_together(law):
    model, end = arm_on_a_hub(law, ["foot.force"]), swing(law, 0.3, 0.0, 0.5)
    for scheme, dt, tolerance in SCHEMES:
        run = mbd.simulate(model, stands(model), scheme, dt=dt, until=0.5)
        found = run.final["hinge.angle"], run.final["hinge.rate"], run["foot.force"][-1]
        np.testing.assert_allclose(found, [*end, load_and_acceleration(*end, law)[0]], rtol=tolerance, atol=tolerance)
        assert run["drive.torque"][-1] == pytest.approx(law(found[2]), rel=1e-12)


@pytest.mark.parametrize("reads", ["foot.force", "foot.friction", "upright.multiplier", "hinge.reaction_force.y"])
def test_the_motion_does_not_depend_on_the_cut(reads):
    ends = []
    for cut in "auto", "all":
        model = arm_on_a_hub(lambda load: 0.1 * load - 0.5, [reads], cut=cut)
        run = mbd.simulate(model, stands(model), mbd.RungeKutta853(), dt=5e-3, until=0.4)
        ends.append([run.final["hinge.angle"], run.final["hinge.rate"], run["foot.force"][-1], run[reads][-1]])
    np.testing.assert_allclose(*ends, rtol=1e-9, atol=1e-9)


def test_a_reaction_is_read_as_a_vector_too():
    whole = arm_on_a_hub(lambda force: 0.1 * force[1], ["hinge.reaction_force"])
    part = arm_on_a_hub(lambda force: 0.1 * force, ["hinge.reaction_force.y"])
    ends = [mbd.simulate(model, stands(model), dt=1e-3, until=0.1).final["hinge.angle"] for model in (whole, part)]
    assert ends[0] == ends[1]


@dataclass(frozen=True)
class LoadedBrake(Loss):
    """``F = c N v`` with the load N of a foot."""

    per_load: float

    def fields(self):
        return {"per_load": self.per_load}

    def force(self, rate, scope, owner):
        return scope.parameter(owner, "per_load", self.per_load) * scope.named("foot.force") * rate


def test_a_loss_follows_a_load_and_dissipates():
    model = arm_on_a_hub(loss=LoadedBrake(0.002))
    run = mbd.simulate(model, stands(model, 1.0), mbd.RungeKutta853(), dt=5e-3, until=0.6)
    power = -0.002 * run["foot.force"] * run["hinge.rate"] ** 2
    np.testing.assert_allclose(run["hinge loss.power"], power, rtol=1e-12)
    assert run.energy["hinge loss"][-1] < -0.01 and abs(run.energy.numerical[-1]) < 1e-9


def test_impacts_follow_no_law_that_reads_forces():
    rates = []
    for law, reads in (0.0, ()), (lambda load: 0.1 * load, ("foot.force",)):
        model = arm_on_a_hub(law, reads)
        start = mbd.assemble(model, {"float.y": 0.05, "hinge.angle": 0.8})
        run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=2e-3, until=0.2)
        strike = next(event for event in run.events if event.kind == "closed")
        rates.append(run.at([strike.time], side="right")["hinge.rate"][0])
    assert rates[0] == pytest.approx(rates[1], rel=1e-12)


def test_a_sample_reads_the_load_just_before_its_outputs_change():
    period, gain, until = 0.01, 0.02, 0.3
    law = mbd.SampledLaw("cell", period, {"drive.torque": lambda load: gain * load}, arguments=["foot.force"])
    y, torque = np.array([0.3, 0.0]), 0.0
    for _ in range(round(until / period)):
        torque = gain * load_and_acceleration(*y, lambda load, held=torque: held)[0]
        y = swing(lambda load, held=torque: held, *y, period)
    model = arm_on_a_hub(others=[law])
    for scheme, dt, tolerance in SCHEMES[:4]:
        whole = mbd.simulate(model, stands(model), scheme, dt=dt, until=until)
        np.testing.assert_allclose([whole.final["hinge.angle"], whole.final["hinge.rate"]], y, atol=tolerance)
    half = mbd.simulate(model, stands(model), mbd.RungeKutta853(), dt=5e-3, until=0.15)
    again = mbd.simulate(model, half.final, mbd.RungeKutta853(), dt=5e-3, until=until)
    assert again.final["hinge.angle"] == pytest.approx(y[0], abs=1e-11)


def test_derivatives_go_through_the_law():
    model = arm_on_a_hub(LAWS["saturating"], ["foot.force"])
    for scheme, dt in (mbd.RungeKutta853(), 5e-3), (mbd.HHT(0.05), 2e-3):
        exact = mbd.sensitivities(model, stands(model), scheme, dt=dt, until=0.3, wrt=["arm.mass"])
        ends = [
            mbd.simulate(model, stands(model), scheme, dt=dt, until=0.3, parameters={"arm.mass": ARM + step})
            for step in (1e-5, -1e-5)
        ]
        slope = (ends[0].final["hinge.angle"] - ends[1].final["hinge.angle"]) / 2e-5
        assert exact["hinge.angle", "arm.mass"] == pytest.approx(slope, rel=1e-7)


def test_a_loop_gain_of_one_or_more_is_refused_by_name():
    model = arm_on_a_hub(lambda load: 2.0 * load, ["foot.force"])
    with pytest.raises(mbd.SimulationError, match="'drive' reads 'foot.force'.*2.91 of what it is.*SampledLaw"):
        mbd.simulate(model, stands(model, 0.5), dt=1e-3, until=0.1)
    model = arm_on_a_hub(lambda load: 0.5 * load, ["foot.force"])
    with pytest.raises(mbd.SimulationError, match="'drive' reads 'foot.force'.*loop gain.*lag"):
        mbd.simulate(model, stands(model), dt=1e-3, until=0.5)


def test_the_force_and_gap_of_a_penalty_contact_are_functions_of_the_motion():
    model, puck = one_body(mbd.PointMass("puck", 1.0), mbd.Translation, "p")
    model.constrain(mbd.Penalty("floor", mbd.touchdown(puck.origin), 1e4, 50.0, friction=0.3))
    reads = ["floor.force", "floor.friction", "floor.gap", "floor.gap_rate"]
    model.apply(mbd.Applied("push", puck.origin, lambda *x: (x[0] + 0.1 * x[1] + x[2] - x[3], 0.0), arguments=reads))
    start = mbd.assemble(model, {"p.x": 0.0, "p.y": 0.01}, {"p.x": 1.0, "p.y": 0.0})
    run = mbd.simulate(model, start, dt=1e-3, until=0.3)
    force, friction, gap, rate = (run[name] for name in reads)
    np.testing.assert_allclose(run["push.force.x"], force + 0.1 * friction + gap - rate, atol=1e-12)
    assert force.max() > 10.0


WRONG = {
    "an event": (mbd.Event("low", mbd.measure(lambda load: load - 10.0, "foot.force")), "'low' waits for .*foot.for"),
    "a transition": (
        mbd.Mode("mode", ("a", "b"), transitions=[mbd.Transition("a", "b", when="foot.force")]), "'mode: a to b' waits"
    ),
    "a memory": (
        mbd.Mode("mode", ("a", "b"), transitions=[mbd.Transition("a", "b", after=0.1)], remembers={"n": "foot.force"}),
        "'mode' stores 'n'",
    ),
    "a row": (mbd.Bilateral("tie", mbd.measure(lambda n, q: n - q, "foot.force", "hinge.angle")), "'tie' reads"),
    "a name": (mbd.Bilateral("tie", mbd.measure(lambda n: n, "foot.forse")), "did you mean 'foot.force'"),
}  # fmt: skip


@pytest.mark.parametrize(("word", "message"), WRONG.values(), ids=WRONG)
def test_what_must_follow_the_motion_alone_is_refused_by_name(word, message):
    model = arm_on_a_hub(lambda load: 0.1 * load, ["foot.force"])
    model.constrain(word)
    with pytest.raises(mbd.ModelError, match=message):
        mbd.assemble(model, {"float.y": 0.0, "hinge.angle": 0.3}, closed="foot")


def test_a_force_that_a_constraint_has_under_another_name_is_offered():
    model, _ = one_body(mbd.PointMass("load", 2.0), mbd.Prismatic, "lift", axis="y")
    lift = model.joints[0]
    model.constrain(mbd.Bilateral("rope", mbd.measure(lambda y, t: y - 0.1 * t, "lift.displacement", "t")))
    model.apply(mbd.Motor("band", lift, force=lambda tension: 0.1 * tension, arguments=["rope.force"]))
    with pytest.raises(mbd.UnknownNameError, match="'band': no force .* 'rope.force'; did you mean 'rope.multiplier'"):
        mbd.assemble(model)


def test_dry_friction_is_read_by_samples_only():
    model, block = one_body(mbd.PointMass("block", 1.0), mbd.Translation, "p")
    model.constrain(mbd.Unilateral("sole", mbd.touchdown(block.origin), friction=0.5))
    push = mbd.Applied("push", block.origin, lambda f: (0.5 * f, 0.0), arguments=["sole.friction"])
    refused = model.without()
    refused.apply(push)
    with pytest.raises(mbd.ModelError, match="dry friction of 'sole'.*SampledLaw"):
        mbd.assemble(refused, {"p.x": 0.0, "p.y": 0.0}, closed="sole")
    model.apply(mbd.Applied("push", block.origin, (1.0, 0.0)))
    model.apply(mbd.SampledLaw("half", 0.01, {"push.force.x": lambda f: 1.0 - 0.5 * f}, arguments=["sole.friction"]))
    run = mbd.simulate(model, mbd.assemble(model, {"p.x": 0.0, "p.y": 0.0}, closed="sole"), dt=1e-3, until=0.2)
    assert run["push.force.x"][-1] == pytest.approx(2.0, rel=0.1)  # 1 + ½ of itself, sample by sample


def test_gaits_their_derivatives_and_batches_follow_a_load():
    model = kneed_walker()
    hips = [joint for joint in model.joints if joint.name.endswith("hip")]
    for hip in hips:
        reads = [f"{hip.name.split()[0]} foot.force", f"{hip.name}.rate", ("per load", 2e-4)]
        model.apply(mbd.Motor(f"{hip.name} brake", hip, lambda load, v, c: -c * load * v, arguments=reads))
    how = {"integrator": mbd.RungeKutta853(), "dt": 0.01}
    start, walks = kneed_walker_start(model), []
    for step in 0.0, 1e-5, -1e-5:
        change = {"hip.mass": 0.5 + step} if step else None
        walks.append(
            mbd.limit_cycle(model, start, **how, section="right foot", mirror=("left", "right"), parameters=change)
        )
    assert walks[0].largest_multiplier < 0.7
    slope = (walks[1].speed - walks[2].speed) / 2e-5
    assert walks[0].derivatives["speed", "hip.mass"] == pytest.approx(slope, rel=1e-7)
    many, one = mbd.batch(model, [start], **how, until=0.4), mbd.simulate(model, start, **how, until=0.4)
    assert many["left hip.angle"][0] == one.final["left hip.angle"]
    assert abs(one.energy.numerical[-1]) < 1e-11
