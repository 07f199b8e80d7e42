"""Branches of gaits: maps whose folds, doublings and tori are known, and the cascades of the cases k3 and k3b."""

import math
from functools import cache

import numpy as np
import pytest

import mbd
from tests.cases.walkers import compass, kneed, standing
from tests.gait.walkers import simplest, slope_of
from tests.problems import case


@cache
def mapped(first: str, second: str) -> mbd.Lagrangian:
    """Two places that a clock sets anew each second to functions of themselves and of p: any map of the plane."""
    from sympy import Symbol, sympify

    x, y, clock = (mbd.Coordinate(name) for name in ("x", "y", "clock"))
    p, k = Symbol("p"), Symbol("k")
    kinetic = (x.v**2 + y.v**2 + clock.v**2) / 2
    model = mbd.Lagrangian("map", [x, y, clock], kinetic=kinetic, potential=0 * p * k, parameters={p: 0.5, k: 1.25})
    names = {"x": x.q, "y": y.q, "p": p, "k": k}
    reset = {x.q: sympify(first, names), y.q: sympify(second, names), clock.q: 0.0, x.v: 0.0, y.v: 0.0, clock.v: 1.0}
    model.constrain(mbd.Event("tick", clock.q - 1.0, direction=1, reset=reset))
    return model


def cycle_of(
    first: str, second: str, p: float, x: float, y: float, model: mbd.Lagrangian | None = None
) -> mbd.LimitCycle:
    """The fixed point of a map."""
    model = mapped(first, second) if model is None else model
    start = mbd.assemble(model, {"x": x, "y": y}, {"clock": 1.0})
    functions = {"scale": lambda value: {"p": value}, "bend": lambda value: {"k": value}}
    values = {"scale": p, "bend": 1.25}
    return mbd.limit_cycle(model, start, section="tick", parameters=values, functions=functions, dt=0.25)


def test_a_branch_goes_around_its_fold():
    gait = cycle_of("p + x - x**2", "0.3*y + 0.2*x", 0.04, 0.2, 0.06)
    assert np.max(np.abs(np.sort(gait.multipliers.real) - np.sort([0.3, 0.6]))) < 1e-9
    found = mbd.branch(gait, "scale", -0.5, steps=8, step=0.1)
    (fold,) = found.points("fold")
    assert abs(fold.value) < 1e-9 and found["scale"][-1] > 0.005
    x = np.array([point.state["x"] for point in found.curve])
    assert np.max(np.abs(found["scale"] - x**2)) < 1e-9 and x[0] > 0.19 and x[-1] < -0.05
    assert found["stable"][0] and not found["stable"][-1]


def test_a_doubling_is_found_and_left_along_the_other_branch():
    gait = cycle_of("p + x - x**2", "0.3*y + 0.2*x", 0.9, 0.95, 0.27)
    found = mbd.branch(gait, "scale", 1.1, step=0.1)
    (doubling,) = found.points("doubling")
    assert abs(doubling.value - 1.0) < 1e-9 and not found.points("fold", "torus")
    twice = found.switch(doubling)
    assert twice.strides == 2 and abs(twice.period - 2.0) < 1e-12 and twice.stability == "stable"
    p = twice.parameters["scale"]
    x = twice.state["x"]
    assert abs(x * x - 2.0 * x + 2.0 - p) < 1e-8 and p > 1.0  # x + F(x) = 2 on the cycle of two
    with pytest.raises(mbd.ModelError, match="point must be a doubling of this branch"):
        found.switch(None)


def test_a_torus_is_found_where_a_complex_pair_crosses_the_unit_circle():
    gait = cycle_of("2*p*x*(1 - y)", "x", 0.97, 0.485, 0.485)
    found = mbd.branch(gait, "scale", 1.05, step=0.1)
    (torus,) = found.points()
    assert torus.kind == "torus" and abs(torus.value - 1.0) < 1e-9
    assert abs(np.abs(np.angle(torus.point.multipliers.values[0])) - math.pi / 3.0) < 1e-7


def test_an_event_that_no_longer_happens_is_located():
    """A gate that x opens at half a second if it is above 0.6; the fixed point is x² = p."""
    model = mapped.__wrapped__("p + x - x**2", "0.3*y + 0.2*x")
    x, clock = model.coordinates[0], model.coordinates[2]
    model.constrain(mbd.Event("gate", x.q - 0.6 - (clock.q - 0.5) ** 2, direction=1))
    gait = cycle_of("", "", 0.4, 0.632, 0.18, model)
    found = mbd.branch(gait, "scale", 0.35, step=0.1)
    (lost,) = found.points("lost event")
    assert lost.what == "gate" and abs(lost.value - 0.36) < 1e-10
    assert "lost event of 'gate' at 0.3" in repr(found)


@pytest.mark.slow
def test_special_points_are_followed_over_a_second_parameter(tmp_path):
    """The fixed point k x² = p doubles at p = 1/k, and loses the gate at x = 0.6 where p = 0.36 k."""
    model = mapped.__wrapped__("p + x - k*x**2", "0.3*y + 0.2*x")
    x, clock = model.coordinates[0], model.coordinates[2]
    model.constrain(mbd.Event("gate", x.q - 0.6 - (clock.q - 0.5) ** 2, direction=1))
    found = mbd.branch(cycle_of("", "", 0.75, 0.775, 0.22, model), "scale", 0.9, step=0.1)
    (doubling,) = found.points("doubling")
    curve = found.follow(doubling, "bend", 1.6, steps=2)
    assert len(curve) == 3 and np.max(np.abs(curve["scale"] - 1.0 / curve["bend"])) < 1e-9
    curve.plot(tmp_path / "curve.png")
    assert (tmp_path / "curve.png").stat().st_size > 10_000
    assert repr(curve).startswith("map: doubling at scale = 0.8 at bend = 1.25, 0.625 at bend = 1.6; 3 points; reached")
    down = mbd.branch(found.gait(0.75), "scale", 0.3, step=0.1)
    (lost,) = down.points("lost event")
    gates = down.follow(lost, "bend", 1.3, steps=1)
    assert gates.what == "gate" and np.max(np.abs(gates["scale"] - 0.36 * gates["bend"])) < 1e-10
    with pytest.raises(
        mbd.ModelError, match="(?s)point must be one of this branch.*parameter 'scale' is that of the branch"
    ):
        down.follow(doubling, "scale", 1.3)


@pytest.mark.slow
def test_the_doubling_over_the_mass_of_the_hip_is_that_of_branches_at_other_masses():
    sizes = case("f2-compass-gait-3deg").definition
    model = compass(sizes)
    start = standing(model, case("f2-compass-gait-3deg")["fixed point"].value, sizes["slope"])
    gait = mbd.limit_cycle(
        model, start, section="right foot", mirror=("left", "right"), parameters={"slope": sizes["slope"]},
        functions=slope_of(sizes["g"]),
    )  # fmt: skip
    slopes = mbd.branch(gait, "slope", 0.105, friction=0.35)
    for kind in ("doubling", "slip"):
        (point,) = slopes.points(kind)
        curve = slopes.follow(point, "hip.mass", 12.0, steps=4)
        (there,) = mbd.branch(gait.at({"hip.mass": 12.0}), "slope", 0.105, friction=0.35).points(kind)
        assert abs(curve["slope"][-1] - there.value) < 1e-9, kind


def test_the_slope_at_which_a_foot_would_slip_is_that_at_which_friction_is_used_up():
    sizes = case("f2-compass-gait-3deg").definition
    model = compass(sizes)
    start = standing(model, [0.218669, -0.323389, -1.092387, -0.377212], sizes["slope"])
    gait = mbd.limit_cycle(
        model, start, section="right foot", mirror=("left", "right"), parameters={"slope": sizes["slope"]},
        functions=slope_of(sizes["g"]),
    )  # fmt: skip
    found = mbd.branch(gait.at({"slope": 0.1}), "slope", 0.106, friction=0.325, step=0.1)
    (slip,) = found.points("slip")
    run = found.gait(slip.value).run
    needed = np.abs(run["left foot.friction.forward"][:-1]) / run["left foot.force"][:-1]
    assert slip.what == "left foot" and abs(np.max(needed) - 0.325) < 1e-9
    # its error is that of the steps too, which longer ones have more of
    for dt in (0.04, 0.08):
        coarse = mbd.limit_cycle(
            model, start, dt=dt, section="right foot", mirror=("left", "right"), parameters={"slope": 0.1},
            functions=slope_of(sizes["g"]),
        )  # fmt: skip
        (other,) = mbd.branch(coarse, "slope", 0.106, friction=0.325, step=0.1).points("slip")
        off = abs(other.value - slip.value)
        assert off > 3.0 * slip.error and 0.2 * off < other.error < 5.0 * off
    with pytest.raises(mbd.ModelError, match="friction must be a positive coefficient or None, not -1"):
        mbd.branch(gait, "slope", 0.106, friction=-1)


@pytest.mark.slow
def test_a_kneed_walker_ends_where_its_bent_leg_grazes_the_slope():
    sizes = case("f3-kneed-walker-chen").definition
    model = kneed(sizes)
    start = standing(model, case("f3-kneed-walker-chen")["fixed point"].value, sizes["slope"])
    gait = mbd.limit_cycle(
        model, start, section="right foot", mirror=("left", "right"), parameters={"slope": sizes["slope"]},
        functions=slope_of(sizes["g"]),
    )  # fmt: skip
    found = mbd.branch(gait, "slope", 0.01)
    (fold,), (scuff,) = found.points("fold"), found.points("scuff")
    assert 0.031 < fold.value < 0.032 and scuff.what == "right foot" and "'right foot' scuffs" in found.stopped
    near = mbd.simulate(
        model, scuff.point.state, mbd.RungeKutta853(), dt=1e-4, until=("right foot", 1.0),
        parameters=gait.map.plain(found.given.with_value(scuff.value)),
    )  # fmt: skip
    middle = (near.time > 0.2 * near.time[-1]) & (near.time < 0.95 * near.time[-1])
    assert abs(np.min(near["right foot.gap"][middle])) < 1e-8


def test_a_cycle_that_neither_dies_out_nor_grows_is_marginal():
    gait = cycle_of("x", "0.3*y + 0.2*x + 0*p*k", 0.3, 0.4, 0.1)
    assert gait.stability == "marginal" and abs(gait.largest_multiplier - 1.0) < 1e-9 and "(marginal)" in repr(gait)


def test_a_parameter_that_changes_nothing_is_named():
    model, start = simplest()
    gait = cycle_of("p + x - x**2", "0.3*y + 0.2*x", 0.3, 0.55, 0.1)
    with pytest.raises(mbd.UnknownNameError, match="no parameter named 'mass'"):
        mbd.branch(gait, "mass", 1.0)
    idle = mbd.limit_cycle(
        model, start, section="heel strike", parameters={"idle": 1.0}, functions={"idle": lambda s: {}}
    )
    with pytest.raises(mbd.ModelError, match="parameter: 'idle' changes nothing of this gait"):
        mbd.branch(idle, "idle", 2.0)


def test_gaits_and_the_first_doubling_of_the_simplest_walker_are_those_of_the_cases(tmp_path):
    reference, table = case("k3-simplest-walker-cascade"), case("f1c-simplest-walker-bifurcations")
    expected = table["multipliers table"]
    gait = mbd.limit_cycle(*simplest(), section="heel strike", parameters={"gamma": expected.t[-2]})
    for slope, multiplier in zip(expected.t[-2:], expected.value[-2:], strict=True):
        near = gait if slope == expected.t[-2] else gait.at({"gamma": slope})
        assert abs(np.min(near.multipliers.real) - multiplier) < expected.accuracy
    found = mbd.branch(gait, "gamma", 0.0152, step=0.1)
    (doubling,) = found.points("doubling")
    assert abs(doubling.value - reference["slope of period doubling 1 -> 2 steps"].value) < 1e-9
    there = [doubling.point.state[name] for name in ("theta", "theta.rate")]
    assert np.max(np.abs(there - table["fixed point at the doubling"].value)) < 1e-8
    assert found["stable"][0] and not found["stable"][-1] and "reached gamma = 0.0152" in repr(found)
    found.plot(tmp_path / "branch.png", "period")
    assert (tmp_path / "branch.png").stat().st_size > 10_000


@pytest.mark.slow
def test_multipliers_of_the_simplest_walker_along_the_slope_are_those_of_the_case():
    expected = case("f1c-simplest-walker-bifurcations")["multipliers table"]
    gait = mbd.limit_cycle(*simplest(), section="heel strike", parameters={"gamma": expected.t[0]})
    for slope, multiplier in zip(expected.t, expected.value, strict=True):
        gait = gait.at({"gamma": slope})
        assert abs(np.min(gait.multipliers.real) - multiplier) < expected.accuracy


@pytest.mark.slow
def test_the_second_doubling_of_the_simplest_walker_is_that_of_the_case():
    reference, two_steps = case("k3-simplest-walker-cascade"), case("f1c-simplest-walker-bifurcations")
    gait = mbd.limit_cycle(*simplest(), section="heel strike", parameters={"gamma": 0.0145})
    (first,) = (one := mbd.branch(gait, "gamma", 0.0155)).points("doubling")
    other = mbd.branch(one.switch(first), "gamma", 0.018)
    (second,) = other.points("doubling")
    assert abs(second.value - reference["slope of period doubling 2 -> 4 steps"].value) < 1e-9
    limping = other.gait(0.0165)
    expected = two_steps["period-2 gait"].value
    states = [limping.state, limping.map(limping.state, limping.parameters, strides=1).state]
    found = np.array([[state["theta"], state["theta.rate"]] for state in states])
    assert min(np.max(np.abs(found - expected)), np.max(np.abs(found - expected[::-1]))) < 5e-9  # feet of 1e-9


@pytest.mark.slow
def test_multipliers_and_doublings_of_the_compass_gait_are_those_of_the_cases():
    sizes, reference = case("f2-compass-gait-3deg").definition, case("k3b-compass-cascade")
    table = case("f2c-compass-gait-bifurcation")
    start = standing(compass(sizes), case("f2-compass-gait-3deg")["fixed point"].value, sizes["slope"])
    gait = mbd.limit_cycle(
        compass(sizes), start, section="right foot", mirror=("left", "right"), parameters={"slope": sizes["slope"]},
        functions=slope_of(sizes["g"]),
    )  # fmt: skip
    one = mbd.branch(gait, "slope", 0.08)
    (first,) = one.points("doubling")
    assert abs(first.value - reference["slope of period doubling 1 -> 2 steps"].value) < 1e-9
    assert abs(math.degrees(first.value) - table["slope of first period doubling"].value) < 1e-6
    for slope, multiplier in zip((3.0, 3.5, 4.0, 4.2, 4.3), table["most negative multiplier"].value, strict=True):
        assert abs(np.min(one.gait(math.radians(slope)).multipliers.real) - multiplier) < 1e-6
    (second,) = mbd.branch(one.switch(first), "slope", 0.0875).points("doubling")
    assert abs(second.value - reference["slope of period doubling 2 -> 4 steps"].value) < 1e-9


@pytest.mark.parametrize(("gap", "step"), [(0.003, 0.1), (0.0005, 0.02)])
def test_a_branch_does_not_jump_to_its_neighbour(gap: float, step: float):
    """Fixed points x = −p² and x = gap − p², whose multipliers are 1 ± 5 gap: ahead along a tangent lies the other."""
    gait = cycle_of(f"x - 5*(x + p**2)*(x + p**2 - {gap})", "0.3*y + 0.2*x", 0.05, -0.0025, -0.0005 / 0.7)
    assert abs(gait.state["x"] + 0.0025) < 1e-9
    found = mbd.branch(gait, "scale", 0.6, step=step)
    x = np.array([point.state["x"] for point in found.curve])
    assert np.max(np.abs(x + found["scale"] ** 2)) < 1e-6
    assert found["scale"][-1] == 0.6 and not found.special
