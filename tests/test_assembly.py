"""A consistent start: named values held exactly, the rest completed with least motion, every conflict told."""

import math

import numpy as np
import pytest
import sympy
from hypothesis import given, settings, strategies as st

import mbd
from mbd.assembly import inertia
from mbd.assembly.posture import damped_step
from mbd.compile.mechanisms import mechanism_of
from tests.simulation.mechanisms import ball, box, falling, kneed_walker, kneed_walker_start, pendulum, point, two_balls

LENGTHS = (0.3, 1.0, 0.8, 0.9)
"""Crank, coupler, rocker and base of the linkage [m]: a crank-rocker."""


def linkage(cut="auto"):
    """A four-bar linkage whose crank can turn fully."""
    model = mbd.Model("linkage", cut=cut)
    crank, coupler, rocker = (
        mbd.Link(name, mass=length, length=length, center=length / 2, inertia=length**3 / 12)
        for name, length in zip(("crank", "coupler", "rocker"), LENGTHS[:3], strict=True)
    )
    model.connect(
        mbd.Revolute("a", model.ground.origin, crank.start),
        mbd.Revolute("b", crank.end, coupler.start),
        mbd.Revolute("c", coupler.end, rocker.end),
        mbd.Revolute("d", model.ground.point(LENGTHS[3], 0.0), rocker.start),
    )
    return model


LINKAGE = linkage()


def residuals(model, state):
    mechanism = mechanism_of(model)
    return mechanism.acceleration_terms(
        0.0, state.q, np.concatenate([state.v, state.z]), mechanism.parameters(state.parameters), state.anchors
    )


# completion ---------------------------------------------------------------------------------------------------------
@settings(max_examples=30)
@given(angle=st.floats(-3.1, 3.1), speed=st.floats(-20.0, 20.0))
def test_a_loop_closes_around_a_named_crank_angle_at_any_speed(angle, speed):
    state = mbd.assemble(LINKAGE, {"a.angle": angle}, {"a.angle": speed})
    assert state["a.angle"] == angle and state["a.rate"] == speed
    terms = residuals(LINKAGE, state)
    assert np.abs(terms.h).max() < 1e-11
    assert np.abs(terms.rate).max() < 1e-9 * (1.0 + abs(speed))


@pytest.mark.parametrize("cut", ["auto", "all", ["b"]])
def test_named_values_are_held_to_the_last_bit_and_the_rest_is_told(cut):
    model = linkage(cut)
    names = mbd.assemble(model, project=True).names
    name = "a.angle" if "a.angle" in names else "crank floating.angle"
    state = mbd.assemble(model, {name: 0.7}, {f"{name}.rate": 2.0})
    assert state[name] == 0.7 and state[f"{name}.rate"] == 2.0
    assert name not in state.moved and len(state.moved) > 0
    for moved, distance in state.moved.items():
        assert distance == pytest.approx(state[moved], abs=1e-15), "defaults are 0: it moved as far as it now is"


def test_values_that_are_not_named_move_least_in_the_metric_of_the_mass():
    """Two masses on a rod of 1 m start 0.6 m apart: the light one gives way four times as far."""
    model = mbd.Model("rod", gravity=(0, 0, 0))
    light, heavy = mbd.PointMass("light", mass=1.0), mbd.PointMass("heavy", mass=4.0)
    model.connect(
        mbd.Prismatic("l", model.ground.origin, light.origin),
        mbd.Prismatic("h", model.ground.point(0.6, 0), heavy.origin),
    )
    model.constrain(mbd.Bilateral("rod", mbd.distance(light.origin, heavy.origin), value=1.0))
    state = mbd.assemble(model)
    assert state["l.displacement"] == pytest.approx(-0.4 * 0.8, abs=1e-9)
    assert state["h.displacement"] == pytest.approx(0.4 * 0.2, abs=1e-9)


@settings(max_examples=15)
@given(x=st.floats(-1.0, 1.0), y=st.floats(0.2, 1.0), u=st.floats(-2.0, 2.0), w=st.floats(-2.0, 2.0))
def test_projected_positions_and_velocities_are_the_nearest_ones(x, y, u, w):
    state = mbd.assemble(CIRCLE, {"place.x": x, "place.y": y}, {"place.x": u, "place.y": w}, project=True)
    length = math.hypot(x, y)
    np.testing.assert_allclose(state.q, [x / length, y / length], atol=1e-9)
    normal = np.array([x, y]) / length
    velocity = np.array([u, w])
    np.testing.assert_allclose(state.v, velocity - normal * (normal @ velocity), atol=1e-9)
    for name, value in (("place.x", x), ("place.y", y)):
        assert state.moved.get(name, 0.0) == pytest.approx(state[name] - value, abs=1e-12)


def circle():
    model, body = point()
    model.constrain(mbd.Bilateral("thread", mbd.distance(model.ground.origin, body.origin), value=1.0))
    return model


CIRCLE = circle()


def test_a_prescribed_motion_gives_the_start_its_speed():
    model, body = point()
    model.constrain(mbd.Bilateral("lift", mbd.height(body.origin), value=lambda t: 0.2 + 3.0 * t))
    state = mbd.assemble(model)
    assert state["place.y"] == pytest.approx(0.2) and state["place.y.rate"] == pytest.approx(3.0)


def test_a_closed_foot_stands_on_the_ground_and_does_not_slip():
    walker = kneed_walker()
    state = kneed_walker_start(walker)
    assert state.mode.closed == {"left foot", "left knee lock"}
    terms = residuals(walker, state)
    rows = [k for k, row in enumerate(mechanism_of(walker).equations.rows) if row.owner in state.mode.closed]
    assert np.abs(terms.h[rows]).max() < 1e-12 and np.abs(terms.rate[rows]).max() < 1e-11
    assert state["left hip.angle"] == 0.2385854603 and state["right hip.rate"] == -0.0571481063


def test_a_foot_may_be_closed_on_a_slope_and_on_a_curved_ground():
    model, body = point()
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(body.origin, ground=lambda x: 0.3 * mbd.sin(2.0 * x))))
    state = mbd.assemble(model, {"place.x": 0.4}, closed="foot")
    assert state["place.y"] == pytest.approx(0.3 * math.sin(0.8), abs=1e-12)
    assert np.abs(state.v).max() == 0.0


def test_parameters_of_the_start_shape_it():
    model = circle()
    state = mbd.assemble(model, {"place.x": 0.0}, parameters={"thread.value": 2.0})
    assert abs(state["place.y"]) == pytest.approx(2.0)
    assert state.parameters == {"thread.value": 2.0}


def test_an_empty_wish_gives_the_defaults():
    state = mbd.assemble(pendulum())
    assert state["hinge.angle"] == 0.0 and state["hinge.rate"] == 0.0 and dict(state.moved) == {}


# who may close ------------------------------------------------------------------------------------------------------
def test_open_contacts_above_or_on_their_surface_are_armed_and_trailing_ones_are_not():
    model, a, b = two_balls()
    model.constrain(
        mbd.Unilateral("A", mbd.height(a.origin)), mbd.Unilateral("B", mbd.height(b.origin), release=mbd.When("A"))
    )
    assert mbd.assemble(model).armed == {"A"}, "B touches and waits for A: it trails"
    assert mbd.assemble(model, {"b.displacement": 0.1}).armed == {"A", "B"}
    assert mbd.assemble(model, open=["A"]).armed == frozenset()
    assert mbd.assemble(model, closed=["B"]).armed == {"A"}


def test_a_start_inside_the_ground_is_told_unless_it_is_named_open():
    with pytest.raises(mbd.AssemblyError, match="'floor' starts 0.2 m inside its surface"):
        mbd.assemble(ball(), {"fall.displacement": -0.2})
    state = mbd.assemble(ball(), {"fall.displacement": -0.2}, open="floor")
    assert state.armed == frozenset() and state["fall.displacement"] == -0.2
    assert mbd.assemble(ball(), {"fall.displacement": -1e-8}).armed == {"floor"}


def test_a_contact_that_is_not_watched_may_start_below_ground():
    model, body = point()
    model.constrain(mbd.Unilateral("foot", mbd.height(body.origin), only_while=mbd.measure("place.x")))
    assert mbd.assemble(model, {"place.x": -1.0, "place.y": -0.1}).mode.closed == frozenset()
    with pytest.raises(mbd.AssemblyError, match="inside"):
        mbd.assemble(model, {"place.x": 1.0, "place.y": -0.1})


# conflicts ----------------------------------------------------------------------------------------------------------
def test_values_that_contradict_a_row_are_told_with_both_residuals_and_can_be_projected():
    wish = {"place.x": 1.0, "place.y": 1.0}
    speed = {"place.x": 1.0, "place.y": 1.0}
    with pytest.raises(mbd.AssemblyError) as refused:
        mbd.assemble(CIRCLE, wish, speed)
    said = str(refused.value)
    assert "'thread'" in said and "0.414" in said and "1.41421" in said and "project=True" in said
    state = mbd.assemble(CIRCLE, wish, speed, project=True)
    assert state["place.x"] == pytest.approx(math.sqrt(0.5)) and set(state.moved) >= {"place.x", "place.y"}


def test_a_named_speed_that_a_closed_contact_forbids_is_told():
    with pytest.raises(mbd.AssemblyError, match="'floor'.*velocity residual 1"):
        mbd.assemble(ball(), velocity={"fall.displacement": 1.0}, closed=["floor"])


def test_an_angle_that_the_linkage_cannot_reach_is_told():
    with pytest.raises(mbd.AssemblyError, match="contradicts"):
        mbd.assemble(LINKAGE, {"a.angle": 0.0, "d.angle": 3.0})


def test_a_start_that_moves_along_a_contact_which_sticks_is_told_that_it_does():
    model, body = mbd.Model("block"), mbd.PointMass("block", 1.0)
    model.connect(mbd.Translation("place", model.ground.origin, body.origin))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(body.origin)))
    with pytest.raises(mbd.AssemblyError, match="'foot' sticks while it is closed, and slides with friction=mu"):
        mbd.assemble(model, {"place.y": 0.0}, {"place.x": 1.0}, closed="foot")
    with pytest.raises(mbd.AssemblyError) as caught:
        mbd.assemble(model, {"place.y": 0.0}, {"place.y": 1.0}, closed="foot")
    assert "sticks" not in str(caught.value), "it opens"


def test_constraints_that_can_never_hold_together_are_told_each():
    model, body = point()
    model.constrain(
        mbd.Bilateral("one", mbd.height(body.origin), value=0.5),
        mbd.Bilateral("two", mbd.height(body.origin), value=0.6),
    )
    with pytest.raises(mbd.AssemblyError) as refused:
        mbd.assemble(model)
    assert "'one'" in str(refused.value) and "'two'" in str(refused.value)


def test_a_motion_that_nothing_determines_is_told_by_its_coordinate():
    model, _body = falling()
    with pytest.raises(mbd.ModelError, match="nothing determines its motion"):
        mbd.assemble(model, parameters={"ball.mass": 0.0})
    y = mbd.Coordinate("y", unit="m")
    m = sympy.Symbol("m")
    point = mbd.Lagrangian("point", [y], kinetic=m * y.v**2 / 2, parameters={m: 2.0})
    with pytest.raises(mbd.AssemblyError, match="nothing determines the motion of 'y'"):
        mbd.assemble(point, parameters={"m": 0.0})


def test_a_massless_body_is_allowed_where_its_motion_is_determined():
    """A massless rod between two loops: its motion is that of its neighbours."""
    model = mbd.Model("massless coupler")
    crank = mbd.Link("crank", mass=1.0, length=0.5, center=0.25, inertia=0.02)
    coupler = mbd.Link("coupler", mass=0.0, length=1.0, center=0.5)
    slider = mbd.PointMass("slider", mass=2.0)
    model.connect(
        mbd.Revolute("a", model.ground.origin, crank.start),
        mbd.Revolute("b", crank.end, coupler.start),
        mbd.Revolute("c", coupler.end, slider.origin),
        mbd.Prismatic("guide", model.ground.origin, slider.origin),
    )
    state = mbd.assemble(model, {"a.angle": 0.3}, {"a.angle": 1.0})
    trajectory = mbd.simulate(model, state, mbd.HHT(0.05), dt=1e-3, until=0.2)
    assert np.isfinite(trajectory.record.lam).all()
    assert np.abs(residuals(model, trajectory.final).h).max() < 1e-11


@pytest.mark.parametrize("parameters", [{"ball.mass": -1.0}, {"ball.mass": -1e-3}])
def test_a_negative_mass_given_as_a_parameter_is_refused(parameters):
    model, _body = falling()
    with pytest.raises(mbd.ModelError, match="mass -.* kg is negative"):
        mbd.assemble(model, parameters=parameters)


def test_a_model_in_which_nothing_moves_is_refused():
    model = mbd.Model("rock")
    model.connect(mbd.Weld("weld", model.ground.origin, mbd.PointMass("rock", mass=1.0).origin))
    with pytest.raises(mbd.AssemblyError, match="nothing can move"):
        mbd.assemble(model)


# wrong words --------------------------------------------------------------------------------------------------------
WRONG = {
    "coordinate": ({"position": {"fall.displacment": 1.0}}, "did you mean 'fall.displacement'"),
    "rate": ({"velocity": {"fall.rat": 1.0}}, "did you mean 'fall.rate'"),
    "closed": ({"closed": ["flor"]}, "did you mean 'floor'"),
    "open": ({"open": ["flor"]}, "did you mean 'floor'"),
    "both": ({"closed": "floor", "open": "floor"}, "both closed and open"),
    "parameter": ({"parameters": {"ball.mas": 1.0}}, "did you mean 'ball.mass'"),
    "nan": ({"position": {"fall.displacement": math.nan}}, "finite"),
    "inf": ({"velocity": {"fall.displacement": math.inf}}, "finite"),
    "text": ({"position": {"fall.displacement": "high"}}, "finite number"),
    "none": ({"position": {"fall.displacement": None}}, "finite number"),
    "array": ({"position": {"fall.displacement": np.zeros(2)}}, "finite number"),
    "no mapping": ({"position": 3.0}, "map names to numbers"),
    "a list": ({"velocity": ["fall.rate"]}, "map names to numbers"),
    "closed number": ({"closed": 3}, "closed"),
    "closed numbers": ({"closed": [3]}, "closed"),
    "parameter nan": ({"parameters": {"ball.mass": math.nan}}, "ball.mass"),
    "backend": ({"backend": "fortran"}, "'llvm'"),
}


@pytest.mark.parametrize(("wish", "said"), WRONG.values(), ids=WRONG)
def test_a_wrong_word_is_refused_with_what_was_meant(wish, said):
    with pytest.raises(mbd.ModelError, match=said):
        mbd.assemble(ball(), **wish)


def test_all_wrong_names_are_told_at_once():
    with pytest.raises(mbd.ModelError) as refused:
        mbd.assemble(ball(), {"fall.x": 1.0}, {"fall.y": 1.0}, closed=["flor"], open=["flr"])
    assert len(refused.value.faults) == 4


def test_a_state_is_asked_by_name_and_printed():
    state = mbd.assemble(box(), {"place.y": 1.0, "place.angle": 0.1}, {"place.angle": 2.0})
    assert (state["place.y"], state["place.angle.rate"]) == (1.0, 2.0)
    with pytest.raises(mbd.UnknownNameError, match="did you mean 'place.angle'"):
        state["place.angel"]
    assert "place.angle" in repr(state) and "closed: none" in repr(state)


@pytest.mark.parametrize("backend", ["auto", "python"])
def test_both_backends_assemble_alike(backend):
    other = mbd.assemble(LINKAGE, {"a.angle": 1.1}, {"a.angle": -3.0}, backend=backend)
    state = mbd.assemble(LINKAGE, {"a.angle": 1.1}, {"a.angle": -3.0})
    np.testing.assert_allclose(other.q, state.q, atol=1e-12)
    np.testing.assert_allclose(other.v, state.v, atol=1e-11)


def chain_with_tip(count: int, mass: float, tip: float) -> mbd.Model:
    """Links one after the other, the last with a heavy bob at its end."""
    model = mbd.Model("chain")
    before = model.ground.origin
    for k in range(count):
        link = mbd.Link(f"link {k}", mass, 0.3, 0.15)
        model.connect(mbd.Revolute(f"joint {k}", before, link.start))
        before = link.end
    bob = mbd.PointMass("bob", tip)
    model.connect(mbd.Weld("weld", before, bob.origin))
    return model


@pytest.mark.parametrize("ratio", [1e6, 1e12, 1e14])
def test_links_that_are_far_lighter_than_what_they_carry_still_have_a_motion_of_their_own(ratio: float) -> None:
    angles = np.random.default_rng(3).uniform(-1, 1, 5)
    model = chain_with_tip(5, 1.0, ratio)
    start = mbd.assemble(model, position={f"joint {k}.angle": float(angle) for k, angle in enumerate(angles)})
    assert [start[f"joint {k}.angle"] for k in range(5)] == pytest.approx(angles)


def test_links_without_mass_have_none() -> None:
    rng = np.random.default_rng(4)
    for tip in (1.0, 1e9):
        model = chain_with_tip(5, 0.0, tip)
        with pytest.raises(mbd.AssemblyError, match="nothing determines the motion"):
            mbd.assemble(model, position={f"joint {k}.angle": float(a) for k, a in enumerate(rng.uniform(-1, 1, 5))})


def test_projection_moves_no_named_value_that_need_not_move():
    named = {"a.angle": 0.3}
    held = mbd.assemble(LINKAGE, named, {"a.angle": 300.0})
    state = mbd.assemble(LINKAGE, named, {"a.angle": 300.0}, project=True)
    assert state["a.angle"] == 0.3 and state["a.angle.rate"] == 300.0
    np.testing.assert_allclose(state.q, held.q, atol=1e-12)


@given(rows=st.integers(1, 5), columns=st.integers(1, 5), seed=st.integers(0, 2**32 - 1), size=st.floats(1e-8, 1e8))
def test_the_damped_step_takes_rows_of_any_rank_and_size(rows: int, columns: int, seed: int, size: float) -> None:
    """Where |h + J x|² + d |x|² is least, Jᵀ (h + J x) + d x = 0; J has half the rank that its shape allows."""
    draw, rank = np.random.default_rng(seed), (min(rows, columns) + 1) // 2
    J, h = size * draw.normal(size=(rows, rank)) @ draw.normal(size=(rank, columns)), draw.normal(size=rows)
    for damping in (1e-12, 1e-3, 1e12):
        x = damped_step(J, h, damping)
        scale = np.linalg.norm(J, 2)
        balance = J.T @ (h + J @ x) + damping * x
        assert np.all(np.isfinite(x))
        assert np.linalg.norm(balance) <= 1e-13 * scale * (np.linalg.norm(h) + scale * np.linalg.norm(x))


@given(
    seed=st.integers(0, 2**32 - 1), n=st.integers(2, 9), power=st.integers(-16, 0), sign=st.sampled_from([-1.0, 1.0])
)
def test_bounds_of_norms_and_factors_find_no_weak_motion_that_singular_values_do_not(seed, n, power, sign):
    """And none is lost: what they pass has none that is below the limits."""
    rng = np.random.default_rng(seed)
    Q = np.linalg.qr(rng.normal(size=(n, n)))[0]
    A = (Q * np.append(sign * 10.0**power, rng.uniform(0.5, 2.0, n - 1))) @ Q.T
    A = 0.5 * (A + A.T)
    scale = np.sqrt(np.max(np.abs(A), axis=1))
    scaled = A / np.outer(scale, scale)
    smallest = np.linalg.svd(scaled)[1][-1]
    if inertia._is_regular(scaled[np.newaxis], n):
        assert smallest > (1.0 - 1e-3) * n * inertia.ROUND_OFF_RTOL
        assert not inertia._weak_motions(A, n)
    else:
        assert smallest < n * n * inertia.ROUND_OFF_RTOL
    least = np.linalg.eigvalsh(scaled)[0]
    if inertia._is_definite(scaled[np.newaxis], -1e-9):
        assert least > -1e-9
    else:
        assert least < -1e-10
