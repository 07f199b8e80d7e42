"""Parameters of gaits: derivatives of multipliers in any unit and beside limits, sides of mirrored gaits, bounds."""

import math

import numpy as np
import pytest
import sympy

import mbd
from mbd.gait.extrapolation import slopes_of
from mbd.gait.map_derivative import map_derivative
from tests.cases.walkers import compass
from tests.gait.test_branches import mapped

SIZES = {"a1": 0.25, "b1": 0.25, "a2": 0.0, "b2": 0.5, "ms": 0.0, "mt": 5.0, "mh": 10.0, "g": 9.81, "slope": 0.0524}


def parabola(p: float, unit: float, value: float, model: mbd.Lagrangian | None = None) -> mbd.LimitCycle:
    """The gait x = √p of the map x' = p + x − x², whose multiplier is 1 − 2 √p, p = p₀ + unit·s at s = value."""
    model = mapped("p + x - x**2", "0.01*y") if model is None else model
    start = mbd.assemble(model, {"x": math.sqrt(p), "y": 0.0}, {"clock": 1.0})
    moved = {"s": lambda s: {"p": p + unit * (s - value)}}
    return mbd.limit_cycle(model, start, section="tick", parameters={"s": value}, functions=moved, dt=0.25)


def test_the_derivative_of_a_multiplier_does_not_know_the_unit_of_the_parameter():
    """d(1 − 2 √p)/ds = −unit/√p, far from the fold at p = 0 and beside it, at zero and at tiny values of s."""
    random = np.random.default_rng(26)
    for unit in 10.0 ** random.uniform(-11.0, 11.0, 5):
        for p in (0.16, 1e-6):
            value = float(random.choice([0.0, 1e-11, 1.0 / unit]))
            gait = parabola(p, unit, value)
            found = gait.derivatives["largest multiplier", "s"]
            assert math.isclose(found, -unit / math.sqrt(p), rel_tol=1e-6), (unit, p, value)


def test_the_derivative_of_a_multiplier_stops_before_other_events():
    """A gate beyond x = 0.6, which throws what passes it elsewhere, stands beside the fixed point."""
    model = mapped.__wrapped__("p + x - x**2", "0.01*y")
    x, y, clock = model.coordinates
    model.constrain(mbd.Event("gate", x.q - 0.6 + 0.1 * (clock.q - 0.5), direction=1, reset={y.q: 1.0, x.q: 0.3}))
    for beside in (1e-2, 1e-3, 1e-5):
        p = (0.55 - beside) ** 2
        found = parabola(p, 1.0, 0.0, model).derivatives["largest multiplier", "s"]
        assert math.isclose(found, 1.0 / math.sqrt(p), rel_tol=1e-6), beside


def test_beside_a_bound_the_derivative_of_a_multiplier_comes_from_the_side_that_is_allowed():
    """A hopper that leaves with v = e v⁻² + k has the multiplier 1 − √(1 − 4 e k); e ≥ 0 where that is said."""
    y, (mass, g, e, k) = mbd.Coordinate("y", unit="m"), sympy.symbols("mass g e k")
    for bound, value in (True, 0.0), (True, 1e-9), (True, 1e-3), (False, 1e-3), (False, 0.0):
        hopper = mbd.Lagrangian(
            "hopper", [y], mass * y.v**2 / 2, mass * g * y.q, parameters={mass: 1.0, g: 9.81, e: value, k: 1.31},
            domains={e: mbd.Domain(low=0.0)} if bound else {}, tunable=["e"],
        )  # fmt: skip
        hopper.constrain(mbd.Event("floor", y.q, direction=-1, reset={y.v: e * y.v**2 + k}))
        gait = mbd.limit_cycle(hopper, mbd.assemble(hopper, {"y": 1e-9}, {"y": 1.3}), section="floor")
        if bound or value:
            right = 2.62 / math.sqrt(1.0 - 5.24 * value)
            assert math.isclose(gait.derivatives["largest multiplier", "e"], right, rel_tol=1e-8)
        else:
            with pytest.raises(mbd.GaitError, match="on one side only: all multipliers are 0 here, and beside it 2.62"):
                gait.derivatives["largest multiplier", "e"]


def test_at_a_fold_a_gait_has_no_derivative():
    gait = parabola(0.0, 1.0, 0.0)
    for number in ("period", "largest multiplier"):
        with pytest.raises(mbd.GaitError, match="no derivative by 's': the branch of gaits has a fold here"):
            gait.derivatives[number, "s"]


def walker(random: np.random.Generator) -> tuple[mbd.Model, mbd.State]:
    """A compass walker of random sizes, and a start near its gait."""
    sizes = {**SIZES, "mh": float(random.uniform(8.0, 12.0)), "b2": float(random.uniform(0.48, 0.52))}
    model = compass(sizes)
    start = mbd.assemble(
        model, closed="left foot", position={"left hip.angle": 0.27, "right hip.angle": -0.27},
        velocity={"left hip.angle": -1.1, "right hip.angle": -0.4},
    )  # fmt: skip
    return model, start


def test_a_parameter_of_one_side_is_refused_in_a_mirrored_gait_and_right_over_a_stride():
    random, mirror = np.random.default_rng(7), ("left", "right")
    model, start = walker(random)
    both = {"both": lambda s: {"left leg.center": s, "right leg.center": s}}
    center = float(model.parameters["left leg.center"])
    more = {"parameters": {"both": center}, "functions": both}
    along = mbd.limit_cycle(model, start, section="right foot", mirror=mirror, **more)
    stride = mbd.limit_cycle(model, start, section="right foot", **more)
    with pytest.raises(mbd.ModelError, match="'left leg.center' is given by the function 'both'; change that"):
        stride.derivatives["speed", "left leg.center"]
    step = mbd.limit_cycle(model, start, section="right foot", mirror=mirror)
    one = {
        "derivatives": lambda name: step.derivatives["speed", name],
        "multiplier": lambda name: step.derivatives["largest multiplier", name],
        "at": lambda name: step.at({name: 1.01 * model.parameters[name]}),
        "branch": lambda name: mbd.branch(step, name, to=1.01 * model.parameters[name]),
        "optimize": lambda name: mbd.optimize(step, {name: (0.5, 0.45, 0.55)}, maximize="speed", progress=False),
        "basin": lambda name: mbd.basin(model, step, {name: [0.5, 0.51]}, workers=1, progress=False),
    }
    for side in mirror:
        for part in ("center", "mass", "inertia"):
            name = f"{side} leg.{part}"
            if name not in model.parameters or not model.parameters[name]:
                continue
            for call in one.values():
                with pytest.raises(mbd.ModelError, match="mirror=.*(differently|another one).*mirror=None"):
                    call(name)
    step, stride = along, mbd.limit_cycle(model, start, section="right foot")
    sides = sum(stride.derivatives["speed", f"{side} leg.center"] for side in mirror)
    assert math.isclose(sides, step.derivatives["speed", "both"], rel_tol=1e-8)
    twice = 2.0 * step.largest_multiplier * step.derivatives["largest multiplier", "both"]
    sides = sum(stride.derivatives["largest multiplier", f"{side} leg.center"] for side in mirror)
    assert math.isclose(sides, twice, rel_tol=1e-6)


def test_a_parameter_without_a_side_in_its_name_that_acts_on_one_side_is_refused_too():
    model, start = walker(np.random.default_rng(8))
    one = {"prosthesis": lambda s: {"left leg.mass": 5.0 * (1.0 + s)}}
    gait = mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"), parameters={"prosthesis": 0.0},
                           functions=one)  # fmt: skip
    with pytest.raises(mbd.ModelError, match="'prosthesis' changes the two sides differently"):
        gait.derivatives["speed", "prosthesis"]


def test_a_value_that_the_model_does_not_allow_is_refused():
    model, start = walker(np.random.default_rng(9))
    gait = mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right"))
    with pytest.raises(mbd.ModelError, match="is negative"):
        gait.at({"hip.mass": -0.1})


@pytest.mark.slow
def test_a_branch_ends_where_the_model_allows_no_further_value():
    model, start = walker(np.random.default_rng(9))
    gait = mbd.limit_cycle(model, start, section="right foot", mirror=("left", "right")).at({"hip.mass": 6.0})
    found = mbd.branch(gait, "hip.mass", to=-30.0)
    assert found["hip.mass"][-1] == 0.0 and "ends at hip.mass = 0: beyond it body 'hip': mass" in found.stopped


FUNCTIONS = {
    "a parameter that passes zero": (lambda s: {"p": 0.1 * (s - 1.0)}, 1.0, (0.1,)),
    "one beside it": (lambda s: {"p": 0.1 * (s - 1.0), "q": s}, 1.0, (0.1, 1.0)),
    "one beside it, at zero": (lambda s: {"p": math.sin(s), "q": 1.0 + s}, 0.0, (1.0, 1.0)),
    "zero up to round-off": (lambda s: {"p": math.sin(math.pi * s), "q": s}, 1.0, (-math.pi, 1.0)),
    "level ground": (lambda s: {"p": math.sin(s), "q": -math.cos(s)}, 0.0, (1.0, 0.0)),
    "a slope": (lambda s: {"p": math.sin(s), "q": -math.cos(s)}, 0.05, (math.cos(0.05), math.sin(0.05))),
    "a tiny unit": (lambda s: {"p": 1.0 + 1e-9 * s}, 1.0, (1e-9,)),
    "a constant beside": (lambda s: {"p": math.exp(s), "q": 3.0}, 1.0, (math.e, 0.0)),
}


def test_slopes_of_functions_are_right_or_unknown():
    """Where they are unknown derivatives follow from differences of runs."""
    known = []
    for title, (function, at, expected) in FUNCTIONS.items():
        found = slopes_of(function, at)
        if found is not None:
            known.append(title)
            np.testing.assert_allclose([*found.values()], expected, rtol=1e-8, atol=1e-12, err_msg=title)
    assert known == ["level ground", "a slope", "a tiny unit", "a constant beside"]


def test_a_parameter_that_passes_zero_beside_another_hides_no_derivative():
    """x = √(p + k) of x' = p + k + x − x², where s gives p = 0.16 s and k = 0.1 (s − 1), at s = 1."""
    model = mapped("p + k + x - x**2", "0.01*y")
    start = mbd.assemble(model, {"x": 0.4, "y": 0.0}, {"clock": 1.0})
    given = {"s": lambda s: {"p": 0.16 * s, "k": 0.1 * (s - 1.0)}}
    gait = mbd.limit_cycle(model, start, section="tick", parameters={"s": 1.0}, functions=given, dt=0.25)
    assert math.isclose(gait.derivatives["largest multiplier", "s"], -0.26 / 0.4, rel_tol=1e-6)
    by = map_derivative(gait.map, gait.chart, np.zeros(gait.chart.size), gait.parameters, ["s"]).matrix[:, -1]
    assert math.isclose(float(np.max(np.abs(by))), 0.26, rel_tol=1e-6)
