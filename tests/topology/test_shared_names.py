"""A body may share its name with one joint or one contact: every result is the one it has under names of its own."""

import numpy as np
import pytest

import mbd


def leg(pin: str, upper: str, lower: str, floor: str) -> mbd.Model:
    """Two links, the lower of which meets a floor, by the names of the first joint, both bodies and the contact."""
    model = mbd.Model("leg")
    thigh, shank = mbd.Link(upper, 1.0, 1.0, 0.5, 0.1), mbd.Link(lower, 1.0, 1.0, 0.5, 0.1)
    model.connect(
        mbd.Revolute(pin, model.ground.origin, thigh.start, loss=mbd.Viscous(0.1), stiffness=2.0),
        mbd.Revolute("knee", thigh.end, shank.start),
    )
    model.constrain(mbd.Unilateral(floor, mbd.measure(lambda p: p[1] + 1.95, f"{lower}.end")))
    return model


def test_results_are_those_under_names_of_their_own():
    shared, own = leg("crank", "crank", "foot", "foot"), leg("pin", "bar", "shank", "floor")
    assert shared.check() == own.check() == []
    one, other = (
        mbd.simulate(model, mbd.assemble(model, {f"{pin}.angle": 0.5}), dt=0.01, until=1.0)
        for model, pin in ((shared, "crank"), (own, "pin"))
    )
    assert one.events and len(one.names) == len(other.names)
    renamed = {"pin": "crank", "bar": "crank", "shank": "foot", "floor": "foot"}
    for name in other.names:
        owner = next((each for each in renamed if name.startswith((f"{each}.", f"{each} "))), "")
        known = renamed.get(owner, "") + name.removeprefix(owner)
        np.testing.assert_array_equal(one[known], other[name], err_msg=name)


@pytest.mark.parametrize(
    ("make", "kinds"),
    [
        (lambda: leg("knee", "thigh", "shank", "floor"), "2 × Revolute"),
        (lambda: leg("hip", "thigh", "shank", "hip"), "1 × Revolute, 1 × Unilateral"),
        (lambda: leg("hip", "hip", "shank", "hip"), "1 × body, 1 × Revolute, 1 × Unilateral"),
    ],
)
def test_names_that_would_be_ambiguous_are_refused(make, kinds):
    with pytest.raises(mbd.ModelError, match=rf"is used \d times \({kinds}\); give each its own name"):
        make().require_valid()


def test_a_point_named_like_a_result_of_the_joint_is_refused():
    model, crank = mbd.Model("crank"), mbd.Link("crank", 1.0, 1.0, 0.5, 0.1)
    model.connect(mbd.Revolute("crank", model.ground.origin, crank.start))
    assert model.check() == []
    model.constrain(mbd.Event("low", mbd.height(crank.point(0.0, -0.3, name="angle"))))
    assert "the name 'crank' is used 2 times" in model.check()[0]


@pytest.mark.parametrize("axis", range(3))
def test_vectors_are_arguments_by_their_names(axis):
    """A place by name is the place of the frame; an angular velocity and a quaternion have their parts in order."""
    model, body = mbd.Model("body"), mbd.RigidBody("body", 1.0, (1.0, 2.0, 2.5))
    model.connect(mbd.Spherical("ball", model.ground.origin, body.point(0.1, 0.2, 0.3)))
    end = body.point(-0.3, 0.1, 0.2, name="end")
    model.constrain(mbd.Event("seen", mbd.height(end)))
    model.observe("by frame", lambda p: p[axis], end)
    for name, function in (("place", lambda p: p[axis]), ("spin", lambda w: w[axis]), ("turn", lambda q: q[1 + axis])):
        argument = {"place": "body.end", "spin": "ball.angular_velocity", "turn": "ball.orientation"}[name]
        model.constrain(mbd.Event(name, mbd.measure(function, argument)))
    assert model.check() == []
    spin = np.array([0.3, -0.2, 0.5])
    start = mbd.assemble(model, {"ball.orientation": ("zxy", (0.4, 0.1, 0.2))}, {"ball.angular_velocity": spin},
                         backend="python")  # fmt: skip
    equations = mbd.equations.derivation.derive(model)
    values = [guard.value for guard in equations.guards[1:]]
    expected = [equations.output(f"body.end.{'xyz'[axis]}"), equations.output(f"ball.angular_velocity.{'xyz'[axis]}"),
                equations.output(f"ball.orientation.{'xyz'[axis]}")]  # fmt: skip
    assert [value.index for value in values] == [each.index for each in expected]
    keys = start.keys()
    assert {f"ball.orientation.{'xyz'[axis]}", f"body.end.{'xyz'[axis]}"} <= set(keys) and len(set(keys)) == len(keys)
    assert all(np.all(np.isfinite(start[name])) for name in keys)


def test_a_force_of_the_name_of_a_body_is_told():
    model, wheel = mbd.Model("cart"), mbd.RigidBody("wheel", 0.2, 0.001)
    model.connect(mbd.Revolute("pin", model.ground.origin, wheel.origin))
    model.apply(mbd.Motor("wheel", model.joints[0], lambda t: t, arguments=["t"]))
    with pytest.raises(mbd.ModelError, match="the name 'wheel' is used 2 times"):
        mbd.assemble(model)
