"""Gaits of machines with discrete states: compared, mirrored by name; what is remembered is part of the gait."""

import math
from typing import Any

import numpy as np
import pytest

import mbd
from mbd.errors import ModelError
from mbd.gait.exact_derivative import exact_derivative
from mbd.gait.map_derivative import measured


def walker(remembers: bool = False, more: tuple[Any, ...] = ()) -> tuple[mbd.Model, mbd.State]:
    """A compass gait that carries a torso, held upright by the hip of the leg that stands.

    With a memory the torso is held at a share of the angle at which the foot touched down, for 0.3 s of each step
    softer than later.
    """
    model = mbd.Model("torso walker", gravity=mbd.on_slope(math.radians(3.0)))
    hip = mbd.PointMass("hip", mass=10.0)
    torso = mbd.Link("torso", mass=2.0, length=0.5, center=0.25, inertia=0.1)
    legs = {side: mbd.Link(f"{side} leg", mass=5.0, length=1.0, center=0.5) for side in ("left", "right")}
    waist = mbd.Revolute("waist", hip.origin, torso.start)
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin), waist)
    steps = [mbd.Transition("left", "right", on="right foot"), mbd.Transition("right", "left", on="left foot")]
    for side, other in ("left", "right"), ("right", "left"):
        ahead = mbd.measure(lambda a, b: a[0] - b[0] - 0.1, legs[side].end, legs[other].end)
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, legs[side].start))
        model.constrain(mbd.Unilateral(
            f"{side} foot", mbd.touchdown(legs[side].end), release=mbd.When(f"{other} foot", may_pull=True),
            only_while=ahead,
        ))  # fmt: skip
    memory = {"left angle": {"left": "left hip.angle"}, "right angle": {"right": "right hip.angle"}}
    model.constrain(mbd.Mode("stance", ("left", "right"), transitions=steps, remembers=memory if remembers else {}))
    if remembers:
        model.constrain(mbd.Mode("grip", ("soft", "firm"), transitions=[
            mbd.Transition("soft", "firm", after=0.3),
            mbd.Transition("firm", "soft", on="stance"),
        ]))  # fmt: skip

    def hold(q: Any, v: Any, angle: Any, grip: Any) -> Any:
        return (100.0 + 20.0 * grip) * (q - math.pi - 0.1 * angle) + 20.0 * v

    for side in legs:
        names = ["waist.angle", "waist.rate", f"stance.{side} angle", "grip"]
        law = hold if remembers else lambda q, v: hold(q, v, 0.0, 0.0)
        names = names if remembers else names[:2]
        joint = next(joint for joint in model.joints if joint.name == f"{side} hip")
        model.apply(
            mbd.Motor(f"{side} hold", waist, torque={side: lambda *x, f=law: -f(*x)}, by="stance", arguments=names),
            mbd.Motor(f"{side} back", joint, torque={side: law}, by="stance", arguments=names),
        )
    model.constrain(*more)
    start = mbd.assemble(
        model, {"left hip.angle": 0.271, "right hip.angle": -0.271, "waist.angle": math.pi},
        {"left hip.rate": -1.0924, "right hip.rate": -0.3774, "waist.rate": 0.0}, closed=["left foot"],
    )  # fmt: skip
    return model, start


def test_a_gait_held_to_the_stance_leg_repeats_itself_on_the_other_side() -> None:
    model, start = walker()
    gait = mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"))
    run = mbd.simulate(model, gait.state, mbd.RungeKutta853(), dt=gait.period / 60.0, until=3.5 * gait.period)
    struck = [event.time for event in run.events if event.kind == "closed"]
    np.testing.assert_allclose(struck, gait.period * np.arange(1, len(struck) + 1), atol=1e-9)
    assert [event.name for event in run.events if event.kind == "event"] == [
        "stance: left to right", "stance: right to left", "stance: left to right",
    ]  # fmt: skip
    stride = mbd.limit_cycle(model, gait.state, section="left foot")
    np.testing.assert_allclose(stride.period, 2.0 * gait.period, atol=1e-9)
    mine, its = (np.sort(np.abs(each)) for each in (np.array(gait.multipliers) ** 2, stride.multipliers))
    np.testing.assert_allclose(mine[-2:], its[-2:], atol=1e-6)


def test_multipliers_do_not_depend_on_where_the_section_is_though_values_are_remembered() -> None:
    late = mbd.Event("passing", mbd.measure(lambda a, b: a + b, "left hip.angle", "right hip.angle"))
    model, start = walker(remembers=True, more=(late,))
    strike = mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"))
    firm = mbd.limit_cycle(model, strike.state, section="grip: soft to firm", mirror=("left", "right"))
    np.testing.assert_allclose(firm.period, strike.period, atol=1e-9)
    sizes = [np.sort(np.abs(each.multipliers))[::-1] for each in (strike, firm)]
    np.testing.assert_allclose(sizes[0][:3], sizes[1][:3], atol=1e-6)
    names = ("stance.left angle", "stance.right angle")
    run = mbd.simulate(model, strike.state, mbd.RungeKutta853(), dt=0.01, until=2.2 * strike.period)
    np.testing.assert_allclose(run.at(1.5 * strike.period)[names[1]], strike.state["left hip.angle"], atol=1e-8)


def one_sided(gait: mbd.LimitCycle, c: Any, h: float) -> Any:
    """∂(coordinates)/∂c of the return map by one-sided differences of order 4."""
    columns = []
    for unit in np.eye(gait.chart.size):
        there = [measured(gait.map, gait.chart, c + k * h * unit, gait.parameters).c for k in range(5)]
        columns.append(np.dot([-25.0, 48.0, -36.0, 16.0, -3.0], there) / (12.0 * h))
    return np.array(columns).T


def one_sided_by(gait: mbd.LimitCycle, c: Any, name: str, h: float) -> Any:
    """∂(numbers of the map)/∂(a parameter) by one-sided differences of order 4."""
    values = [{**gait.parameters, name: gait.parameters[name] + k * h} for k in range(5)]
    there = [measured(gait.map, gait.chart, c, each).numbers for each in values]
    return np.dot([-25.0, 48.0, -36.0, 16.0, -3.0], there) / (12.0 * h)


@pytest.mark.parametrize(
    ("section", "strides", "mirror"),
    [
        ("right foot", 1, ("left", "right")), ("grip: soft to firm", 2, ("left", "right")), ("right foot", 2, None),
        ("passing", 1, None), ("sway", 1, None),
    ],
)  # fmt: skip
def test_return_maps_with_remembered_values_have_exact_derivatives(section: str, strides: int, mirror: Any) -> None:
    """Timers, sections that watch a remembered value, a state of first order; on the gait and beside it."""
    random = np.random.default_rng(len(section) + strides)
    passing = mbd.measure(lambda q, held: q + 0.5 * held, "right hip.angle", "stance.left angle")
    sway = mbd.measure(lambda v, held: v - 0.2 * held, "right hip.rate", "stance.left angle")
    model, start = walker(
        remembers=True, more=(mbd.Event("passing", passing, direction=1), mbd.Event("sway", sway, direction=1))
    )
    waist = next(joint for joint in model.joints if joint.name == "waist")
    inductance = random.uniform(0.1, 0.3)
    model.apply(mbd.DCMotor("fan", waist, lambda v: -v, 1.0, 0.2, inductance, arguments=["waist.rate"]))
    start = mbd.assemble(
        model, dict(zip(start.names, start.q, strict=True)), dict(zip(start.velocity_names, start.v, strict=True)),
        closed=["left foot"],
    )  # fmt: skip
    numbers = {"grip.soft to firm.after": random.uniform(0.2, 0.4), "torso.mass": random.uniform(1.8, 2.2)}
    strike = mbd.limit_cycle(model, start, section="right foot", parameters=numbers)
    gait = mbd.limit_cycle(model, strike.state, section=section, mirror=mirror, strides=strides, parameters=numbers)
    assert gait.map_derivative.how.startswith("exact")
    for c in (np.zeros(gait.chart.size), 1e-3 * random.uniform(-1.0, 1.0, gait.chart.size)):
        whole, size = exact_derivative(gait.map, gait.chart, c, gait.parameters, list(numbers)), gait.chart.size
        exact, by_numbers = whole[:size, :size], whole[:, size:]
        for h in (2e-4, -2e-4):
            np.testing.assert_allclose(exact, one_sided(gait, c, h), atol=1e-7 * np.max(np.abs(exact)))
            for k, (name, value) in enumerate(numbers.items()):
                expected = one_sided_by(gait, c, name, 20.0 * h * value)
                np.testing.assert_allclose(by_numbers[:, k], expected, atol=1e-6 * np.nanmax(np.abs(expected)))


def test_what_is_stored_of_other_remembered_values_is_a_part_of_the_gait_where_it_is_stored() -> None:
    """The rate of the torso at the strike before the last one moves its rest: a dimension of the return map."""
    plain, _ = walker(remembers=True)
    model = plain.without("stance", "left hold", "right hold", "left back", "right back")
    joints = {joint.name: joint for joint in model.joints}
    steps = [mbd.Transition("left", "right", on="right foot"), mbd.Transition("right", "left", on="left foot")]
    memory = {"now": "waist.rate", "before": "stance.now"}
    model.constrain(mbd.Mode("stance", ("left", "right"), transitions=steps, remembers=memory))

    def hold(q: Any, v: Any, before: Any) -> Any:
        return 100.0 * (q - math.pi - 0.1 * before) + 20.0 * v

    reads = ["waist.angle", "waist.rate", "stance.before"]
    for side in ("left", "right"):
        model.apply(
            mbd.Motor(f"{side} hold", joints["waist"], torque={side: lambda *x: -hold(*x)}, by="stance",
                      arguments=reads),
            mbd.Motor(f"{side} back", joints[f"{side} hip"], torque={side: hold}, by="stance", arguments=reads),
        )  # fmt: skip
    start = mbd.assemble(
        model, {"left hip.angle": 0.271, "right hip.angle": -0.271, "waist.angle": math.pi},
        {"left hip.rate": -1.0924, "right hip.rate": -0.3774, "waist.rate": 0.0}, closed=["left foot"],
    )  # fmt: skip
    strike = mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"))
    later = mbd.limit_cycle(model, strike.state, section="grip: soft to firm", mirror=("left", "right"))
    np.testing.assert_allclose(strike.period, later.period, atol=1e-9)
    sizes = [np.sort(np.abs(each.multipliers))[::-1][:3] for each in (strike, later)]
    np.testing.assert_allclose(sizes[0], sizes[1], atol=1e-6)


def test_runs_of_many_starts_are_those_of_each_to_the_bit() -> None:
    model, start = walker(remembers=True)
    rates = np.linspace(-0.1, 0.1, 4)
    names = ["left hip.angle", "waist.rate", "stance.index", "grip.time"]
    many = mbd.batch(
        model, (start, {"waist.rate": rates}), mbd.RungeKutta853(), dt=0.01, until="grip: soft to firm", results=names
    )
    assert many.success.all()
    for k in range(len(rates)):
        one = mbd.simulate(model, many.start(k), mbd.RungeKutta853(), dt=0.01, until="grip: soft to firm")
        np.testing.assert_array_equal([many[name][k] for name in names], [one[name][-1] for name in names])


def test_a_mirror_needs_partners_of_modes_and_of_what_they_remember() -> None:
    model, start = walker()
    model.constrain(mbd.Mode("left grip", ("soft", "firm"), transitions=[mbd.Transition("soft", "firm", after=0.3)]))
    with pytest.raises(ModelError, match="mode 'left grip' has no partner 'right grip'"):
        mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"))
    model, start = walker()
    model.constrain(
        mbd.Mode(
            "gait",
            ("left push", "rest"),
            transitions=[
                mbd.Transition("left push", "rest", after=0.3),
                mbd.Transition("rest", "left push", on="left foot"),
            ],
        )
    )
    with pytest.raises(ModelError, match="state 'left push' of mode 'gait' has no partner 'right push'"):
        mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"))


def test_a_mode_that_never_changes_leaves_a_gait_as_it_is() -> None:
    far = mbd.measure(lambda angle: angle - 9.0, "waist.angle")
    idle = mbd.Mode("alarm", ("quiet", "loud"), transitions=[
        mbd.Transition("quiet", "loud", when=far), mbd.Transition("loud", "quiet", after=0.2),
    ])  # fmt: skip
    gaits = [
        mbd.limit_cycle(
            *walker(more=more), mbd.RungeKutta853(), dt=0.01, section="right foot", mirror=("left", "right")
        )
        for more in ((), (idle,))
    ]
    assert gaits[1].period == pytest.approx(gaits[0].period, rel=1e-12)
    assert len(gaits[1].multipliers) == len(gaits[0].multipliers)


def test_a_gait_of_one_foot_has_derivatives_though_its_steps_have_no_length() -> None:
    model = mbd.Model("hopper")
    body = mbd.PointMass("body", mass=80.0)
    rail = mbd.Prismatic("rail", model.ground.origin, body.origin, axis="y")
    model.connect(rail)
    model.constrain(
        mbd.Unilateral("floor", mbd.height(body.origin)),
        mbd.Mode("leg", ("flight", "wait", "thrust"), transitions=[
            mbd.Transition("flight", "wait", on="floor"),
            mbd.Transition("wait", "thrust", after=0.05),
            mbd.Transition("thrust", "flight", after="leg.time of thrust"),
        ], numbers={"time of thrust": 0.1}),
    )  # fmt: skip
    model.apply(mbd.Motor("drive", rail, force={"thrust": 80.0 * (9.81 + 20.0)}, by="leg"))
    start = mbd.assemble(model, {"rail.displacement": 0.5})
    gait = mbd.limit_cycle(model, start, section="floor")

    def period(thrust: float) -> float:  # wait, thrust, and free flight from y = a T²/2 with v = a T
        rise, speed = 10.0 * thrust**2, 20.0 * thrust
        return 0.05 + thrust + (speed + math.sqrt(speed**2 + 2.0 * 9.81 * rise)) / 9.81

    np.testing.assert_allclose(gait.period, period(0.1), rtol=1e-12)
    slope = (period(0.1 + 1e-5) - period(0.1 - 1e-5)) / 2e-5
    np.testing.assert_allclose(gait.derivatives["period", "leg.time of thrust"], slope, rtol=1e-8)
    later = mbd.limit_cycle(model, gait.state, section="leg: wait to thrust")
    np.testing.assert_allclose(later.period, gait.period, rtol=1e-11)


def sampled_walker(period: float, restart_on: Any = ()) -> tuple[mbd.Model, mbd.State]:
    """The torso is held by a sampled law, 4 ms after each sample."""
    plain, start = walker()
    model = plain.without("left hold", "right hold", "left back", "right back")
    joints = {joint.name: joint for joint in model.joints}

    def hold(q: Any, v: Any) -> Any:
        return 100.0 * (q - math.pi) + 20.0 * v

    model.apply(
        mbd.SampledLaw("PD", period, {"u": hold}, arguments=("waist.angle", "waist.rate"), delay=0.004,
                       restart_on=restart_on),
        mbd.Motor("hold", joints["waist"], torque=lambda u: -u, arguments=["PD.u"]),
        *(mbd.Motor(f"{side} back", joints[f"{side} hip"], torque={side: lambda u: u}, by="stance", arguments=["PD.u"])
          for side in ("left", "right")),
    )  # fmt: skip
    start = mbd.assemble(
        model, {name: start[name] for name in ("left hip.angle", "right hip.angle", "waist.angle")},
        {name: start[name] for name in ("left hip.rate", "right hip.rate", "waist.rate")}, closed=["left foot"],
    )  # fmt: skip
    return model, start


def test_a_walk_falls_in_with_samples_of_nearly_a_whole_part_of_its_period() -> None:
    """Of 37 samples a step a gait lasts 37 sample periods, and so does its derivative by the period."""
    how: Any = {"section": "right foot", "mirror": ("left", "right")}
    model, start = sampled_walker(0.7468 / 37.0)
    gait = mbd.limit_cycle(model, start, **how)
    np.testing.assert_allclose(gait.period, 0.7468, atol=1e-10)
    np.testing.assert_allclose(gait.derivatives["period", "PD.period"], 37.0, rtol=1e-8)
    model, start = sampled_walker(0.02)
    told = r"samples of 'PD' come every 0.02 s, 37\.3\d+ of them in a return of 0\.746\d+ s, where a gait needs a whole"
    with pytest.raises(
        mbd.GaitError, match=told + r" number; try 'PD.period' = 0\.0201\d+ s or strides=3, or restart_on="
    ):
        mbd.limit_cycle(model, start, **how)


@pytest.mark.slow
def test_a_sampled_law_whose_samples_restart_at_strikes_has_a_gait_and_its_derivatives() -> None:
    model, start = sampled_walker(0.02, ("left foot", "right foot"))
    gait = mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"))
    np.testing.assert_allclose(gait.period, 0.74694, atol=1e-5)  # continuous feedback: 0.746772 s

    def period(change: float) -> float:
        values = {"PD.period": 0.02 + change}
        return mbd.limit_cycle(
            model, gait.state, section="right foot", mirror=("left", "right"), parameters=values
        ).period

    near, far = (period(h) - period(-h) for h in (1e-5, 2e-5))
    np.testing.assert_allclose(gait.derivatives["period", "PD.period"], (8.0 * near - far) / 12e-5, rtol=1e-5)


def test_states_that_only_a_start_has_are_walked_past() -> None:
    """A side swings 'off' until its first strike and never again: the gait is one of the states that recur."""
    more = [
        mbd.Mode(f"{side} swing", ("off", "push", "rest"), transitions=[
            mbd.Transition(("off", "rest"), "push", on=f"{other} foot"), mbd.Transition("push", "rest", after=0.12),
        ])
        for side, other in (("left", "right"), ("right", "left"))
    ]  # fmt: skip
    model, start = walker(more=tuple(more))
    for side in "left", "right":
        joint = next(joint for joint in model.joints if joint.name == f"{side} hip")
        names = [f"{side} hip.rate", f"{side} swing.time"]
        law = {"push": lambda v, t: 4.0 * t - 0.2 * v}
        model.apply(mbd.Motor(f"{side} push", joint, torque=law, by=f"{side} swing", arguments=names))
    given = mbd.assemble(
        model, {name: start[name] for name in ("left hip.angle", "right hip.angle", "waist.angle")},
        {name: start[name] for name in ("left hip.rate", "right hip.rate", "waist.rate")}, closed=["left foot"],
    )  # fmt: skip
    gait = mbd.limit_cycle(model, given, section="right foot", mirror=("left", "right"))
    walked = mbd.simulate(model, gait.state, mbd.RungeKutta853(), dt=gait.period / 60.0, until=3.5 * gait.period)
    struck = [event.time for event in walked.events if event.kind == "closed"]
    np.testing.assert_allclose(struck, gait.period * np.arange(1, 4), atol=1e-9)
    assert "off" not in set(walked["left swing"]) | set(walked["right swing"])
