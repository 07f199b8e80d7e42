"""Gaits of the cases f1, f1b, f2, f2b, f3, f3b, f5, k1, k2, k2b: fixed points, periods, multipliers, derivatives."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.gait.floquet import multipliers_of
from mbd.gait.mirror import mirror_of
from mbd.gait.outcome import fall_of
from mbd.gait.section import Chart
from mbd.sensitivity.derivative import final_state_derivative
from tests.cases.walkers import compass, kneed, standing
from tests.gait.walkers import simplest, simplest_start, slope_of, two_sided
from tests.helpers import one_body
from tests.problems import case

MULTIPLIERS = 1e-9
"""Largest error of multipliers [-]."""


def conjugates(values) -> np.ndarray:
    """Complex numbers of a case, real parts first, in the order of the gait's."""
    real, imaginary = (np.asarray(part, dtype=float) for part in values)
    found = real + 1j * imaginary
    return found[np.argsort(-np.abs(found), kind="stable")]


def spread(one, other) -> float:
    """Largest distance of numbers from their nearest partners."""
    return max(float(np.min(np.abs(np.asarray(other) - value))) for value in one)


@cache
def symmetric(name: str, **more) -> mbd.LimitCycle:
    """The one-step gait of a walker of equal sides, from a start of three digits."""
    reference = case(name)
    sizes = reference.definition
    model = compass(sizes) if sizes["ms"] == 0.0 else kneed(sizes, late=name.startswith("f3b"))
    published = [q for key, q in reference.quantities.items() if key.startswith(("fixed point", "state just after"))]
    state = np.round(published[0].value, 3)
    state[1] = -2.0 * sizes["slope"] - state[0]
    return mbd.limit_cycle(
        model, standing(model, state, sizes["slope"]), section="right foot", mirror=("left", "right"),
        parameters={"slope": sizes["slope"]}, functions=slope_of(sizes["g"]), **more,
    )  # fmt: skip


@pytest.mark.parametrize("name", [
    "f2-compass-gait-3deg", "f3-kneed-walker-chen", "f2b-compass-gait-3deg-g980665",
    pytest.param("f3b-kneed-walker-human", marks=pytest.mark.slow),
])  # fmt: skip
def test_gaits_of_equal_sides_are_the_published_ones(name):
    reference, gait = case(name), symmetric(name)
    stance = ("left hip.angle", "right hip.angle", "left hip.rate", "right hip.rate")
    found = np.array([gait.state[part] for part in stance])
    found[:2] -= reference.definition["slope"]
    assert np.max(np.abs(found - reference["fixed point"].value)) < 1e-9
    assert abs(gait.period - reference["step period"].value) < 1e-10
    assert abs(gait.distance - reference["step length"].value) < 1e-10
    assert abs(gait.step_lengths["right foot"] - gait.distance) < 1e-9
    assert spread(conjugates(reference["Floquet"].value), gait.multipliers) < MULTIPLIERS
    assert gait.stability == "stable" and gait.error < 1e-11 and max(gait.residual.values()) < 1e-9
    assert gait.trivial["translation trunk.x"] == 1.0
    assert math.isclose(gait.cost_of_transport, math.sin(reference.definition["slope"]), rel_tol=1e-9)


def test_derivatives_of_the_compass_gait_are_those_of_the_case():
    reference, gait = case("k1-compass-gait-derivatives"), symmetric("f2-compass-gait-3deg")
    names = {"period": "period", "step length along the slope": "distance", "speed along the slope": "speed"}
    for theirs, ours in names.items():
        for parameter, word in (("slope angle", "slope"), ("hip mass", "hip.mass")):
            expected = reference[f"d({theirs}) / d({parameter})"].value
            assert abs(gait.derivatives[ours, word] - expected) < 1e-9 * max(1.0, abs(expected))
    expected = reference["d(largest |multiplier|) / d(slope angle)"].value
    assert abs(gait.derivatives["largest multiplier", "slope"] - expected) < 1e-8


@pytest.mark.parametrize("name", ["f1-simplest-walker-long", "f1b-simplest-walker-short"])
def test_gaits_of_the_simplest_walker_are_the_published_ones(name):
    reference, (model, _) = case(name), simplest()
    expected = reference["fixed point"].value
    start = simplest_start(model, round(expected[0], 3), round(expected[1], 3))
    gait = mbd.limit_cycle(model, start, section="heel strike")
    found = [gait.state[part] for part in ("theta", "theta.rate", "phi", "phi.rate")]
    assert np.max(np.abs(found - expected)) < 5e-9  # feet of 1e-9 of the hip's mass
    assert abs(gait.period - reference["step period"].value) < 5e-8
    assert spread(conjugates(reference["Floquet"].value), gait.multipliers) < 1e-7
    assert gait.stability == ("stable" if name.startswith("f1-") else "unstable")
    assert gait.trivial["forgotten"] == (0.0,)


@cache
def limping(name: str) -> mbd.LimitCycle:
    """A walker of unequal legs, A on the left."""
    reference = case(name)
    sizes = reference.definition
    knees = name == "k2b-asymmetric-kneed"
    legs = {
        side: {part: float(value) for part, value in sizes[leg].items()}
        for side, leg in (("left", "leg_A"), ("right", "leg_B"))
    }
    model = two_sided(legs, sizes["mh"], sizes["g"], sizes["slope"], knees)
    stance, rate, swing = next(iter(reference.quantities.values())).value
    state = np.round([stance, -2.0 * sizes["slope"] - stance, rate, swing], 3)
    state[1] = -2.0 * sizes["slope"] - state[0]
    start = standing(model, state, sizes["slope"])
    return mbd.limit_cycle(
        model, start, section="left foot", parameters={"slope": sizes["slope"]}, functions=slope_of(sizes["g"])
    )


@pytest.mark.parametrize("name", [
    "k2-asymmetric-compass", pytest.param("k2b-asymmetric-kneed", marks=pytest.mark.slow),
])  # fmt: skip
def test_gaits_of_unequal_sides_are_those_of_the_cases(name):
    reference, gait = case(name), limping(name)
    lengths, times = np.split(reference["step lengths"].value, 2)
    found = [gait.step_lengths[f"{side} foot"] for side in ("right", "left")]
    assert np.max(np.abs(found - lengths)) < 1e-9
    found = [gait.step_times[f"{side} foot"] for side in ("right", "left")]
    assert np.max(np.abs(found - times)) < 1e-9
    assert spread(conjugates(reference["Floquet"].value), gait.multipliers) < MULTIPLIERS
    slope = reference.definition["slope"]
    state = [gait.state["left hip.angle"] - slope, gait.state["left hip.rate"], gait.state["right hip.rate"]]
    assert np.max(np.abs(state - reference["state just after heel strike"].value)) < 1e-9
    expected = reference["symmetry index of step length 2"].value
    assert np.max(np.abs([symmetry(gait, what) for what in ("length", "time")] - expected)) < 1e-9
    names = "symmetry index of step length, of step time, mean speed, stride period, largest |multiplier|"
    for parameter, word in (("shank mass ms of leg B", "right shank.mass"), ("slope angle", "slope")):
        expected = reference[f"d({names}) / d({parameter})"].value
        found = [symmetry(gait, "length", word), symmetry(gait, "time", word),
                 gait.derivatives["speed", word], gait.derivatives["period", word]]  # fmt: skip
        assert np.max(np.abs(found - expected[:4])) < 1e-8
        by = gait.derivatives["largest multiplier", word]
        assert abs(by - expected[4]) < 1e-8 * max(1.0, abs(expected[4]))


def test_step_times_and_their_derivatives_are_the_same_whatever_the_section():
    struck, model = limping("k2-asymmetric-compass"), limping("k2-asymmetric-compass").map.model.without()
    passing = mbd.measure(lambda mine, its: mine - its - 0.05, "left hip.angle", "right hip.angle")
    model.constrain(mbd.Event("legs pass", passing, direction=+1))
    how = {"parameters": struck.parameters, "functions": struck.map.functions}
    run = mbd.simulate(model, struck.state, dt=struck.dt, until=("legs pass", 5.0))
    passed = mbd.limit_cycle(model, run.final, section="legs pass", **how)
    assert {name for name, *_ in passed.steps} == {name for name, *_ in struck.steps}
    assert 0.1 < passed.steps[0][1] / passed.step_times[passed.steps[0][0]] < 0.9  # the section lies within a step
    for foot, value in struck.step_times.items():
        assert passed.step_times[foot] == pytest.approx(value, rel=1e-9)
        by = [gait.derivatives[f"step time of {foot}", "slope"] for gait in (struck, passed)]
        assert by[1] == pytest.approx(by[0], rel=1e-7)


def symmetry(gait: mbd.LimitCycle, what: str, parameter: str = "") -> float:
    """2 (b − a)/(b + a) of the steps that foot B ends and those of A, or its derivative by a parameter."""
    values = gait.step_lengths if what == "length" else gait.step_times
    b, a = (values[f"{side} foot"] for side in ("right", "left"))
    if not parameter:
        return 2.0 * (b - a) / (b + a)
    db, da = (gait.derivatives[f"step {what} of {side} foot", parameter] for side in ("right", "left"))
    return 4.0 * (a * db - b * da) / (a + b) ** 2


def test_one_step_of_an_unequal_walker_is_refused():
    gait = limping("k2-asymmetric-compass")
    with pytest.raises(mbd.ModelError, match="is another one: .*'left shank.mass' is 2, 'right shank.mass' 1.5"):
        mbd.limit_cycle(gait.map.model, gait.state, section="right foot", mirror=("left", "right"))


def test_multipliers_of_two_mirrored_steps_are_squares_and_do_not_depend_on_the_section():
    one = symmetric("f2-compass-gait-3deg")
    two = symmetric("f2-compass-gait-3deg", strides=2)
    assert spread(one.multipliers**2, two.multipliers) < MULTIPLIERS
    for section in ("left foot", "right foot"):
        stride = mbd.limit_cycle(one.map.model, one.state, section=section, parameters=one.map.plain(one.parameters))
        assert spread(one.multipliers**2, stride.multipliers) < MULTIPLIERS
    assert abs(two.period - 2.0 * one.period) < 1e-9


@pytest.mark.parametrize("short", [0.0, 1e-9, 3e-7, 5e-6])
def test_multipliers_know_of_directions_that_the_map_nearly_forgets(short):
    """Eigenvalues above 0.04 of random maps, whose range has five directions and a short sixth."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        others = np.linalg.qr(rng.standard_normal((7, 7)))[0]
        P = rng.standard_normal((7, 5)) @ rng.standard_normal((5, 7)) * 0.5 + short * np.outer(others[0], others[1])
        found = multipliers_of(P, np.full(P.shape, 1e-13))
        exact = np.linalg.eigvals(P)
        kept = found.values[np.abs(found.values) > 0.04]
        assert len(kept) >= 2
        for value in kept:
            assert np.min(np.abs(exact - value)) < 1e-9


def test_multipliers_do_not_depend_on_an_event_within_the_step_at_which_the_section_is():
    gait = symmetric("f2-compass-gait-3deg")
    model = compass(case("f2-compass-gait-3deg").definition)
    upright = mbd.measure(lambda mine, its: mine - its, "left hip.angle", "right hip.angle", unit="rad")
    model.constrain(mbd.Event("legs pass", upright))
    stride = mbd.limit_cycle(model, gait.state, section="right foot")
    between = mbd.limit_cycle(model, gait.state, section="legs pass", mirror=("left", "right"))
    assert spread(gait.multipliers**2, stride.multipliers) < MULTIPLIERS
    assert spread(gait.multipliers, between.multipliers) < MULTIPLIERS


def test_differences_of_runs_agree_with_the_exact_derivative_of_one():
    gait = symmetric("f2-compass-gait-3deg")
    exact, instant = final_state_derivative(gait.run, [*gait.state.names, *gait.state.velocity_names])
    mirror, basis = gait.map.mirror, gait.chart.basis
    P = basis.T @ exact[np.concatenate([mirror.q, len(mirror.q) + mirror.v])] @ basis
    assert np.max(np.abs(P - gait.map_derivative.matrix[: gait.chart.size])) < 1e-9
    assert np.max(np.abs(instant @ basis - gait.map_derivative.matrix[gait.chart.size])) < 1e-10


def test_a_walk_that_begins_further_on_goes_on_further_on():
    gait = symmetric("f2-compass-gait-3deg")
    q, anchors = gait.state.q.copy(), gait.state.anchors.copy()
    q[0] += 0.37
    anchors[gait.map.manager.contacts[0].anchors[0]] += 0.37
    here, there = gait.map(gait.state), gait.map(replace(gait.state, q=q, anchors=anchors))
    move = there.state.q - here.state.q
    assert abs(move[0] - 0.37) < 1e-14 and np.max(np.abs(move[1:])) < 1e-14


def test_a_walk_that_falls_scuffs_or_never_strikes_says_so():
    gait = symmetric("f2-compass-gait-3deg")
    model, slope = gait.map.model, gait.parameters["slope"]
    plain = gait.map.plain(gait.parameters)

    def outcome(*state, **more):
        start = standing(model, state, slope)
        with pytest.raises(mbd.GaitError) as caught:
            mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"), parameters=plain, **more)
        found = caught.value.gait
        assert not found.success and str(found.outcome) in str(caught.value) and "no gait" in repr(found)
        assert len(found.run) and found.attempts
        return str(found.outcome)

    assert outcome(0.2187, -0.3234, -0.5, -0.2).startswith("falls backward at ")
    assert outcome(0.2187, -0.3234, -0.1, 0.0).startswith("falls backward at ")  # and strikes when it is down
    assert outcome(0.2187, -0.3234, -2.5, -0.3).startswith("falls forward at ")
    text = outcome(0.2187, -0.3234, -0.9, -0.3)  # it makes a step and more before; the time counts from a later strike
    assert text.startswith("falls forward at ") and " s after 'right foot', in return " in text
    first = outcome(0.2187, -0.3234, -1.6, -0.3)  # it falls before its first strike
    start = standing(model, (0.2187, -0.3234, -1.6, -0.3), slope)
    with pytest.warns(mbd.MbdWarning, match="pulled"):
        run = mbd.simulate(
            model, replace(start, parameters={}), mbd.HHT(), dt=1e-3, until=("right foot", 5.0), parameters=plain,
            on_failure="return",
        )  # fmt: skip
    fall = fall_of(run, "left foot")
    assert fall is not None and "after" not in first
    assert float(first.split()[3]) == pytest.approx(fall.time, abs=2e-3)
    assert "does not happen within 0.1 s" in outcome(0.2187, -0.3234, -1.1, -0.4, longest=0.1)


@pytest.mark.parametrize(("name", "ends"), [("footfall", False), ("fallen", True)])
def test_only_an_event_that_ends_the_run_is_a_fall_by_its_name(name, ends):
    model, _ = one_body(mbd.Link("rod", 1.0, length=1.0, center=1.0), mbd.Revolute, "pin", title="pendulum")
    model.constrain(mbd.Event(name, mbd.measure(lambda a: a, "pin.angle"), terminal=ends))
    run = mbd.simulate(model, mbd.assemble(model, {"pin.angle": 0.4}), dt=0.01, until=1.0)
    assert len(run.events) == 1 and run.status == ends
    assert (fall_of(run, "") is not None) == ends


def test_a_scuff_is_named():
    sizes = case("f3-kneed-walker-chen").definition
    model = kneed(sizes)
    start = standing(model, [0.188, -0.289, -1.4, -0.9], sizes["slope"])
    gait = mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"), on_failure="return")
    assert not gait.success and gait.outcome.kind in ("scuffs", "falls")


def test_a_search_finds_both_gaits_and_says_how_each_try_went():
    model, _ = simplest()
    found = mbd.find_gait(
        model, {"theta": (0.15, 0.25), "phi": (0.3, 0.5)}, {"theta": (-0.25, -0.15), "phi": 0.0}, closed=(),
        section="heel strike", tries=8, longest=8.0, all_gaits=True,
    )  # fmt: skip
    assert len(found.gaits) == 2 and found.gait.stability == "stable"
    assert abs(found.gait.period - case("f1-simplest-walker-long")["step period"].value) < 1e-7
    assert abs(found.gaits[1].period - case("f1b-simplest-walker-short")["step period"].value) < 1e-7
    assert len(found.tries) == 8 == sum(found.outcomes().values())
    assert {each.gait for each in found.tries} == {-1, 0, 1}
    assert "2 gaits in 8 tries" in repr(found) and "theta.rate" in found._repr_html_()
    first = mbd.find_gait(
        model, {"theta": (0.15, 0.25), "phi": (0.3, 0.5)}, {"theta": (-0.25, -0.15), "phi": 0.0}, closed=(),
        section="heel strike", tries=8, longest=8.0,
    )  # fmt: skip
    assert first.gait.stability == "stable" and abs(first.gait.period - found.gait.period) < 1e-9
    ended = [each.gait for each in first.tries]
    assert ended[-1] == 0 and 0 not in ended[:-1], "the search ends with the first stable gait"
    none = mbd.find_gait(model, {"theta": 0.3, "phi": 0.1}, {}, closed=(), section="heel strike", tries=1, longest=2.0)
    with pytest.raises(
        mbd.GaitError, match="no gait in 1 try: 1 × 'heel strike' does not happen within 2 s; the section"
    ):
        _ = none.gait


def test_energy_that_nothing_takes_is_a_multiplier_of_its_own():
    arm = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.6, inertia=0.05)
    arm.connect(mbd.Revolute("hinge", arm.ground.origin, rod.start))
    arm.constrain(mbd.Event("below", mbd.measure(lambda a: a, "hinge.angle", unit="rad"), direction=1))
    gait = mbd.limit_cycle(arm, mbd.assemble(arm, {"hinge.angle": 0.5}), section="below")
    assert gait.success and not len(gait.multipliers) and abs(gait.trivial["energy"][0] - 1.0) < 1e-8


def test_the_gait_of_round_feet_is_the_published_one():
    reference = case("f5-roundfoot-walker")
    sizes, expected = reference.definition, reference["fixed point"].value
    model = mbd.Model("round feet", gravity=mbd.on_slope(sizes["gam"], sizes["g"]))
    hip = mbd.PointMass("hip", sizes["M"])
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    legs = {
        side: mbd.Link(f"{side} leg", sizes["m"], length=sizes["l"], center=sizes["c"], inertia=sizes["I"])
        for side in ("left", "right")
    }
    centers = {side: leg.point(0.0, sizes["r"] - sizes["l"]) for side, leg in legs.items()}
    for side, other in ("left", "right"), ("right", "left"):
        ahead = mbd.measure(lambda mine, its: mine[0] - its[0], centers[side], centers[other])
        foot, release = mbd.rolling_touchdown(centers[side], sizes["r"]), mbd.When(f"{other} foot")
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, legs[side].start))
        model.constrain(mbd.Unilateral(f"{side} foot", foot, release=release, only_while=ahead))
    angle, stance, swing = -np.round(expected, 3)
    start = mbd.assemble(
        model, {"left hip.angle": angle, "right hip.angle": -angle},
        {"left hip.angle": stance, "right hip.angle": swing}, closed="left foot", open="right foot",
    )  # fmt: skip
    gait = mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"))
    found = [gait.state[name] for name in ("left hip.angle", "left hip.rate", "right hip.rate")]
    assert np.max(np.abs(found + expected)) < 1e-9 and abs(gait.period - reference["step period"].value) < 1e-9
    assert spread(conjugates(reference["Floquet"].value), gait.multipliers) < MULTIPLIERS
    assert gait.trivial["translation trunk.x"] == 1.0


@cache
def wheel_with_a_pendulum() -> mbd.Model:
    """A rimless wheel with a pendulum on its hub, past which it turns; its angle on the wheel counts the turns."""
    model = mbd.Model("wheel with a pendulum", gravity=mbd.on_slope(0.15), tunable=["hinge spring.stiffness"])
    wheel = mbd.RigidBody("wheel", 1.0, inertia=(0.2, 0.2, 0.4))
    bob = mbd.RigidBody("bob", 0.3, inertia=(0.01, 0.01, 0.01), center=(0.0, -0.3, 0.0))
    model.connect(mbd.Planar("roll", model.ground.origin, wheel.origin))
    model.connect(mbd.Revolute("hinge", wheel.origin, bob.origin, loss=mbd.Viscous(0.2), stiffness=1e-9))
    for k in range(8):
        tip = wheel.point(math.sin(k * math.pi / 4), -math.cos(k * math.pi / 4), name=f"tip {k}")
        model.constrain(mbd.Unilateral(f"spoke {k}", mbd.touchdown(tip), release=mbd.When(f"spoke {(k + 1) % 8}")))
    return model


def pendulum_on_a_wheel(stiffness: float) -> mbd.LimitCycle:
    model, values = wheel_with_a_pendulum(), {"hinge spring.stiffness": stiffness}
    start = mbd.assemble(
        model, closed="spoke 0", position={"roll.angle": math.pi / 8, "hinge.angle": -math.pi / 8},
        velocity={"roll.angle": -2.0, "hinge.angle": 2.0}, parameters=values,
    )  # fmt: skip
    return mbd.limit_cycle(model, start, section="spoke 0", parameters=values)


@pytest.mark.parametrize(("stiffness", "turns"), [(0.0, 1.0), (0.1, 0.0)])
def test_an_angle_that_counts_its_turns_comes_back_after_whole_ones(stiffness, turns):
    gait = pendulum_on_a_wheel(stiffness)  # a spring that turns wind up is another one after each of them
    assert gait.stability == "stable"
    final = gait.walk(1).final
    assert (final["hinge.angle"] - gait.state["hinge.angle"]) / (2.0 * math.pi) == pytest.approx(turns, abs=1e-10)
    assert final["hinge.rate"] == pytest.approx(gait.state["hinge.rate"], abs=1e-9)
    lost = sum(gait.energy[name] for name in ("joint loss", "impact"))
    assert lost == pytest.approx(-gait.energy["gravity"], rel=1e-9)


def test_a_motion_that_dies_out_is_no_gait():
    arm = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.6, inertia=0.05)
    arm.connect(mbd.Revolute("hinge", arm.ground.origin, rod.start, loss=mbd.Viscous(0.1)))
    arm.constrain(mbd.Event("below", mbd.measure(lambda a: a, "hinge.angle", unit="rad"), direction=1))
    with pytest.raises(mbd.GaitError, match="pendulum: comes to rest at 'below'"):
        mbd.limit_cycle(arm, mbd.assemble(arm, {"hinge.angle": 0.5}), section="below")


def test_what_is_not_the_same_at_a_later_time_is_refused_by_name():
    def arm(word):
        model = mbd.Model("arm")
        rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.6, inertia=0.05)
        model.connect(mbd.Revolute("hinge", model.ground.origin, rod.start))
        model.constrain(mbd.Event("below", mbd.measure(lambda a: a, "hinge.angle", unit="rad"), direction=1))
        model.apply(word(rod))
        return model

    shaken = arm(lambda rod: mbd.Applied("push", rod.end, force=(lambda t: mbd.sin(t), 0.0)))
    with pytest.raises(mbd.ModelError, match="something of the model depends on time itself"):
        mbd.limit_cycle(shaken, mbd.assemble(shaken, {"hinge.angle": 0.5}), section="below")
    brake = mbd.Controller("brake", lambda time, values, state: {}, on=("below",), writes=("rod.mass",))
    held = arm(lambda rod: brake)
    with pytest.raises(mbd.ModelError, match="the controller 'brake' keeps its state and the parameters"):
        mbd.limit_cycle(held, mbd.assemble(held, {"hinge.angle": 0.5}), section="below")


def test_wrong_arguments_are_named():
    model, start = simplest()
    with pytest.raises(mbd.UnknownNameError, match="section: no contact or event named 'heal strike'; did you mean"):
        mbd.limit_cycle(model, start, section="heal strike")
    with pytest.raises(mbd.ModelError, match="no coordinate or contact has one of these words"):
        mbd.limit_cycle(model, start, section="heel strike", mirror=("left", "right"))
    with pytest.raises(mbd.ModelError, match=r"functions has 'slope'; give its value too"):
        mbd.limit_cycle(model, start, section="heel strike", functions={"slope": lambda s: {"gamma": s}})
    with pytest.raises(mbd.UnknownNameError, match="no parameter named 'gama'"):
        mbd.limit_cycle(model, start, section="heel strike", wrt=["gama"])
    lame, _ = one_body(mbd.PointMass("hip", 1.0), mbd.Translation, "left trunk", title="lame")
    with pytest.raises(mbd.ModelError, match="coordinate 'left trunk.x' has no partner 'right trunk.x'"):
        mirror_of(mechanism_of(lame).equations, ("left", "right"))


def test_a_gait_shows_itself(tmp_path):
    gait = symmetric("f2-compass-gait-3deg")
    assert repr(gait).startswith("compass gait: period 0.734346 s, step 0.535445 m, speed 0.72915 m/s, cost of tran")
    assert "multiplier 1" in gait._repr_html_() and "energy from gravity" in gait._repr_html_()
    gait.plot(tmp_path / "gait.png")
    assert (tmp_path / "gait.png").stat().st_size > 10_000
    mode = gait.modes[0]
    assert set(mode) > {"left hip.angle", "right hip.angle.rate"}


def test_the_state_of_a_gait_has_its_parameters():
    """A run from it is the gait, with values that the model does not have, here those of a slope."""
    gait = symmetric("f2-compass-gait-3deg")
    changed = gait.at({"slope": gait.parameters["slope"] + 0.002})
    for one in (gait, changed):
        assert dict(one.state.parameters) == one.map.plain(one.parameters)
        run = mbd.simulate(one.map.model, one.state, one.map.integrator, dt=one.dt, until=one.period)
        assert run["left hip.angle"][-1] == pytest.approx(one.state["right hip.angle"], abs=1e-9)


def test_what_a_search_keeps_is_what_it_would_find_again():
    """The state asked of a chart last, and the mirror image of a walker, are those of a chart and a walker anew."""
    gait = symmetric("f2-compass-gait-3deg")
    chart, parameters = gait.chart, gait.map.vector(gait.parameters)
    one, other = np.full(chart.size, 1e-3), np.linspace(-1e-3, 1e-3, chart.size)
    for c in (one, one, other, one):
        kept, new = chart.at(c, parameters), Chart(chart.section, chart.state, chart.parameters).at(c, parameters)
        assert all(np.array_equal(getattr(kept, part), getattr(new, part)) for part in ("q", "v", "z", "anchors"))
    steeper = gait.map.vector({**gait.parameters, "slope": gait.parameters["slope"] + 1e-3})
    new = Chart(chart.section, chart.state, chart.parameters).at(one, steeper)
    assert np.array_equal(chart.at(one, steeper).v, new.v)


def test_sides_that_were_alike_are_compared_again_with_other_parameters():
    gait = symmetric("f2-compass-gait-3deg")
    model, known = gait.map.model, dict(gait.parameters)
    mass = next(name for name in model.parameters if name.startswith("left") and name.endswith(".mass"))

    def search(**more: float) -> mbd.LimitCycle:
        return mbd.limit_cycle(
            model, gait.state, section="right foot", mirror=("left", "right"), parameters={**known, **more},
            functions=slope_of(case("f2-compass-gait-3deg").definition["g"]),
        )  # fmt: skip

    first = search()
    for _ in range(2):
        with pytest.raises(mbd.ModelError, match="the mechanism with its sides exchanged is another one"):
            search(**{mass: 1.1 * model.parameters[mass]})
    again = search()
    assert np.array_equal(first.state.q, again.state.q) and np.array_equal(first.state.v, again.state.v)
    assert first.period == again.period


@pytest.mark.parametrize("others", [{}, {"gamma": 0.0092}])
def test_a_search_leaves_its_arrays_to_the_next_which_finds_the_same_to_the_bit(others) -> None:
    model, start = simplest()

    def found(values):
        gait = mbd.limit_cycle(model, start, section="heel strike", parameters=values)
        assert gait.map_derivative is not None
        return [each.tobytes() for each in (gait.state.q, gait.state.v, gait.multipliers, gait.map_derivative.matrix)]

    first, idle = found({}), mechanism_of(model).idle
    left = set(map(id, idle.values()))
    assert left
    found(others)
    assert found({}) == first
    now = set(map(id, idle.values()))
    assert now if others else left == now  # other parameters may have another step, and more than are kept
