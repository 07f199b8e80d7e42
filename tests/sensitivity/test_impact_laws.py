"""Derivatives through impacts in sequence and through Poisson's: closed forms, differences of runs, ties by name."""

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

import mbd
from mbd.sensitivity.derivative import final_state_derivative
from tests.helpers import one_body
from tests.sensitivity.differences import differences
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start

LAWS = ("sequential", "poisson")
SCHEME = mbd.RungeKutta853()
BOUNCES = (0.8, 0.6, 0.9)
BLOW = {"p0.displacement": -0.5, "p1.displacement": 0.1, "p2.displacement": 0.2, "p3.displacement": 0.3}


def chain(restitutions):
    """Balls of unequal masses in a row on a rail that touch; the first comes with 1 m/s."""
    model = mbd.Model("chain", gravity=(0, 0, 0))
    for k in range(len(restitutions) + 1):
        body = mbd.PointMass(f"ball {k}", mass=(1.3, 0.7, 0.45, 0.9)[k])
        model.connect(mbd.Prismatic(f"p{k}", model.ground.origin, body.origin))
    for k, e in enumerate(restitutions):
        gap = mbd.measure(lambda a, b: b - a - 0.1, f"p{k}.displacement", f"p{k + 1}.displacement")
        model.constrain(mbd.Unilateral(f"c{k}", gap, restitution=e))
    return model


def corner(e, bounce=0.8):
    """A rod whose upper end comes to a wall as its lower one slides along a rough floor."""
    model, body = one_body(mbd.RigidBody("rod", mass=1.2, inertia=0.13), mbd.Planar, "place", title="corner")
    model.constrain(
        mbd.Unilateral("floor", mbd.touchdown(body.point(-0.5, 0.0)), restitution=e, friction=0.3),
        mbd.Unilateral(
            "wall",
            mbd.measure(lambda x, angle: 0.9 - x - 0.5 * mbd.cos(angle), "place.x", "place.angle"),
            restitution=bounce,
        ),
    )
    return model


def column(restitutions=(0.5, 0.3, 0.2)):
    """Balls of unequal masses that rest on each other and on the ground; the last one falls on them."""
    model = mbd.Model("column")
    for k, e in enumerate(restitutions):
        body = mbd.PointMass(f"ball {k}", mass=(1.3, 0.7, 0.45)[k])
        model.connect(mbd.Prismatic(f"p{k}", model.ground.origin, body.origin, axis="y"))
        names = [f"p{k}.displacement"] if k == 0 else [f"p{k - 1}.displacement", f"p{k}.displacement"]
        gap = mbd.measure(lambda *y: y[-1] - (y[0] if len(y) > 1 else 0.0), *names)
        model.constrain(mbd.Unilateral(f"c{k}", gap, restitution=e))
    return model


def arriving(model):
    """The rod of the corner on its way to the wall."""
    return mbd.assemble(model, {"place.angle": 0.9, "place.x": 0.1}, {"place.x": 3.0}, closed=["floor"])


def falling(model):
    return mbd.assemble(model, {"p2.displacement": 0.4}, closed=["c0", "c1"])


def struck(model):
    return mbd.assemble(model, BLOW, {"p0.displacement": 1.0})


SCENES = {
    "chain": (chain(BOUNCES), struck, ["p0.displacement.rate", "p0.displacement", "ball 1.mass"], 1.0),
    "column": (column(), falling, ["p2.displacement", "p2.displacement.rate", "ball 0.mass", "gravity.y"], 0.2865),
    "corner": (corner(0.0), arriving, ["place.angle", "place.x", "place.x.rate", "rod.inertia"], 0.25),
    "rebound": (corner(0.4), arriving, ["place.angle", "place.angle.rate", "place.x.rate", "rod.inertia"], 0.25),
    "walker": (
        kneed_walker(),
        kneed_walker_start,
        ["left hip.angle", "right hip.angle.rate", "right thigh.mass"],
        0.65,
    ),
}
EQUAL = {f"ball {k}.mass": 0.8 for k in range(4)}


def one_after_the_other(v, m, e):
    """Speeds (K,) after the pairwise impacts of a row of balls that touch, the fastest first; complex too."""
    v = np.array(v, dtype=complex)
    while (approach := v[:-1] - v[1:]).real.max() > 1e-12:
        k = int(np.argmax(approach.real))
        push = (1.0 + e[k]) * approach[k] * m[k] * m[k + 1] / (m[k] + m[k + 1])
        v[k], v[k + 1] = v[k] - push / m[k], v[k + 1] + push / m[k + 1]
    return v


@given(masses=st.lists(st.floats(0.2, 3.0), min_size=4, max_size=4))
@example(masses=[3.0, 0.3, 1.0, 2.0])
@settings(max_examples=10, deadline=None)
def test_pairwise_impacts_of_unequal_masses_have_the_derivatives_of_their_formula(masses):
    e, model, values = BOUNCES, SCENES["chain"][0], {f"ball {k}.mass": mass for k, mass in enumerate(masses)}
    rates = [f"p{k}.displacement.rate" for k in range(4)]
    wrt = ["p0.displacement.rate", *values, *(f"c{k}.restitution" for k in range(3))]
    found = mbd.sensitivities(
        model, struck(model), SCHEME, dt=0.1, until=1.0, parameters=values, impact="sequential", wrt=wrt, of=rates
    )
    at, columns = [1.0, *masses, *e], []
    for k in range(len(at)):
        moved = np.array(at, dtype=complex)
        moved[k] += 1e-30j
        columns.append(one_after_the_other([moved[0], 0.0, 0.0, 0.0], moved[1:5], moved[5:]).imag / 1e-30)
    wanted = np.column_stack(columns)
    assert found.matrix == pytest.approx(wanted, abs=1e-8 * np.max(np.abs(wanted)))


def test_two_impacts_one_after_the_other_in_closed_form():
    """v₂⁺ = (1 + e₀)(1 + e₁) m₀ m₁ / ((m₀ + m₁)(m₁ + m₂)) v₀."""
    e, a, b, c = (0.7, 0.5), 1.3, 0.7, 0.45
    model = chain(e)
    start = mbd.assemble(model, {k: BLOW[k] for k in list(BLOW)[:3]}, {"p0.displacement": 1.0})
    wrt = ["p0.displacement.rate", "ball 0.mass", "ball 1.mass", "ball 2.mass", "c0.restitution", "c1.restitution"]
    found = mbd.sensitivities(
        model, start, mbd.Newmark(), dt=0.1, until=1.0, impact="sequential", wrt=wrt, of=["p2.displacement.rate"]
    )
    last = 1.7 * 1.5 * a * b / ((a + b) * (b + c))
    parts = [1.0, b / (a * (a + b)), 1 / b - 1 / (a + b) - 1 / (b + c), -1 / (b + c), 1 / 1.7, 1 / 1.5]
    assert found.values[-1] == pytest.approx(last, rel=1e-12)
    assert found.matrix[0] == pytest.approx(last * np.array(parts), rel=1e-9)


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("scene", SCENES)
def test_derivatives_are_limits_of_differences(scene, law):
    model, start, names, until = SCENES[scene]
    given = {"dt": 0.01, "until": until, "impact": law}
    state, time = final_state_derivative(mbd.simulate(model, start(model), SCHEME, **given), names)
    wanted, _ = differences(model, start(model), SCHEME, names, **given)
    size = np.maximum(np.max(np.abs(wanted), axis=0), 1e-2)  # a direction may change nothing
    assert np.max(np.abs(np.vstack([state, time]) - wanted) / size) <= 1e-8


@pytest.mark.parametrize("law", LAWS)
def test_restitutions_of_every_contact_are_parameters(law):
    def ends(floor, wall):
        model = corner(floor, bounce=wall)
        return mbd.simulate(model, arriving(model), SCHEME, dt=0.01, until=0.25, impact=law).final

    model, step = corner(0.4), 1e-4
    found = mbd.sensitivities(
        model, arriving(model), SCHEME, dt=0.01, until=0.25, impact=law, wrt=["floor.restitution", "wall.restitution"],
        of=["place.x", "place.y", "place.angle", "place.x.rate", "place.y.rate", "place.angle.rate"],
    )  # fmt: skip
    wanted = []
    for floor, wall in ((1.0, 0.0), (0.0, 1.0)):
        quotients = []
        for h in (step, 0.5 * step):
            one, two = (ends(0.4 + s * h * floor, 0.8 + s * h * wall) for s in (1.0, -1.0))
            quotients.append(np.concatenate([one.q - two.q, one.v - two.v]) / (2.0 * h))
        wanted.append((4.0 * quotients[1] - quotients[0]) / 3.0)
    wanted = np.column_stack(wanted)
    assert found.matrix == pytest.approx(wanted, abs=1e-8 * np.max(np.abs(wanted)))


@pytest.mark.parametrize("law", ["newton", *LAWS])
def test_contacts_that_touch_by_chance_are_named(law):
    model = SCENES["chain"][0]
    with pytest.raises(mbd.CapabilityError, match=r"'c1' may touch .* one side"):
        mbd.sensitivities(model, struck(model), SCHEME, dt=0.1, until=1.0, impact=law, wrt=["p1.displacement"])


def test_ties_in_the_order_are_named():
    model = chain((1.0, 1.0, 1.0))
    given = {"dt": 0.1, "until": 1.0, "impact": "sequential", "parameters": EQUAL, "wrt": ["ball 1.mass"]}
    with pytest.raises(mbd.CapabilityError, match=r"'c0' and 'c1' may go on .* one side"):
        mbd.sensitivities(model, struck(model), SCHEME, **given)
    model, position = chain((0.5, 0.6, 0.5)), {**BLOW, "p1.displacement": -0.4}
    pairs = mbd.assemble(model, position, {"p0.displacement": 1.0, "p1.displacement": 1.0})
    with pytest.raises(mbd.CapabilityError, match=r"'c0' and 'c2' approach equally fast .* one side"):
        mbd.sensitivities(model, pairs, SCHEME, **given)
    given |= {"wrt": ["c1.restitution"], "of": [f"p{k}.displacement.rate" for k in range(4)]}  # which breaks no tie
    found = mbd.sensitivities(model, pairs, SCHEME, **given)
    wanted = one_after_the_other([1.0, 1.0, 0.0, 0.0], [0.8] * 4, [0.5, 0.6 + 1e-30j, 0.5]).imag / 1e-30
    assert found.matrix[:, 0] == pytest.approx(wanted, rel=1e-9)


def test_a_restitution_of_zero_is_named_where_a_change_of_it_gives_an_impulse_back():
    model = corner(0.4, bounce=0.0)
    given = {"dt": 0.01, "until": 0.25, "impact": "poisson"}
    with pytest.raises(mbd.CapabilityError, match=r"the restitution of 'wall' is 0: it has derivatives on one side"):
        mbd.sensitivities(model, arriving(model), SCHEME, wrt=["wall.restitution"], **given)
    assert np.isfinite(
        mbd.sensitivities(model, arriving(model), SCHEME, wrt=["floor.restitution"], **given).matrix
    ).all()


@pytest.mark.parametrize("kick", [0.0, 0.26])
@pytest.mark.parametrize("axes", ["xy", "xyz"])
@pytest.mark.parametrize("law", ["newton", *LAWS])
def test_a_ball_that_just_sticks_as_it_strikes_has_two_derivatives(law, axes, kick):
    """It sticks by −μ v_y up to v_x, and loses no more beyond: ∂v_x⁺/∂v_x is 0 below and 1 above."""
    model, ball = one_body(mbd.PointMass("ball", mass=1.3), mbd.Translation, "place", gravity=(0, 0, 0), axes=axes)
    model.constrain(
        mbd.Unilateral("floor", mbd.touchdown(ball.origin), friction=0.5, restitution=0.0),
        mbd.Impulse("kick", ball.origin, kick, "floor", direction=(1, 0), order="with"),
    )
    given = {"dt": 0.1, "until": 1.5, "impact": law, "wrt": ["place.x.rate"], "of": ["place.x.rate"]}
    limit = 0.5 - kick / 1.3
    for part, expected in ((-0.1, 0.0), (0.0, None), (0.1, 1.0)):
        start = mbd.assemble(model, {"place.y": 1.0}, {"place.x": limit + part, "place.y": -1.0})
        if expected is not None:
            found = mbd.sensitivities(model, start, SCHEME, **given)
            assert found.matrix == pytest.approx(np.array([[expected]]), abs=1e-9)
            continue
        with pytest.raises(mbd.errors.OneSidedError, match="'floor' may go on in either of two ways") as caught:
            mbd.sensitivities(model, start, SCHEME, **given)
        assert caught.value.sides["place.x.rate", "place.x.rate"] == pytest.approx((0.0, 1.0), abs=1e-6)
