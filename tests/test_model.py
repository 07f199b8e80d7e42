"""The model as users hold it: three verbs, names, parameters, copies."""

import math
import pickle
import subprocess
import sys

import pytest

import mbd
from mbd.errors import ModelError, UnknownNameError
from mbd.model import Model
from tests.topology.mechanisms import chain, four_bar, kneed_walker


def test_gravity_on_a_slope_pulls_downhill():
    x, y, z = mbd.on_slope(0.1, g=10.0)
    assert (x, y, z) == pytest.approx((10 * math.sin(0.1), -10 * math.cos(0.1), 0.0))


def test_bodies_come_in_the_order_of_connection():
    assert list(kneed_walker().bodies) == ["ground", "hip", "left thigh", "left shank", "right thigh", "right shank"]


def test_constraints_are_sorted_by_kind():
    model = kneed_walker()
    model.constrain(
        mbd.Bilateral("rod", mbd.distance(model.ground.origin, model.joints[0].child), value=1.0),
        mbd.Event("fall", mbd.height(model.joints[0].child), terminal=True),
        mbd.Penalty("stop", mbd.flexion(model.joints[2]), stiffness=1.0),
    )
    assert [word.name for word in model.bilaterals] == ["rod"]
    assert [word.name for word in model.events] == ["fall"]
    assert [word.name for word in model.contacts] == [
        "left foot", "left knee lock", "right foot", "right knee lock", "stop",
    ]  # fmt: skip


def test_parameters_are_named_after_their_owner():
    parameters = kneed_walker().parameters
    assert parameters["left thigh.mass"] == 0.5
    assert parameters["left thigh.length"] == 0.5
    assert parameters["left knee loss.coefficient"] == 0.1
    assert parameters["gravity.x"] == pytest.approx(9.81 * math.sin(0.0504))
    assert four_bar().parameters["ground.post.x"] == 1.0


def test_named_points_are_frames_of_the_model():
    frames = four_bar().frames
    assert frames["ground.post"].offset == (1.0, 0.0, 0.0)
    assert "crank.end" in frames


def test_a_copy_without_effects_leaves_the_model_as_it_was():
    model = kneed_walker()
    before = model.describe()
    bare = model.without("left knee loss", "right knee lock", "gravity")
    assert model.describe() == before
    losses = {joint.name: joint.loss for joint in bare.joints}
    assert losses["left knee"] is None
    assert losses["right knee"] == mbd.Viscous(0.1)
    assert [contact.name for contact in bare.contacts] == ["left foot", "left knee lock", "right foot"]
    assert bare.gravity == (0.0, 0.0, 0.0)


def test_a_copy_without_a_joint_tells_what_it_no_longer_holds():
    assert any("'left shank'" in fault for fault in kneed_walker().without("left knee").check())


def test_a_copy_without_a_spring_and_a_loss():
    model = Model("knee")
    shank = mbd.Link("shank", 1.0, 0.4, 0.2, 0.01)
    effects = {"loss": mbd.Viscous(0.2), "stiffness": 3.0, "rest": 0.1}
    model.connect(mbd.Revolute("knee", model.ground.origin, shank.start, **effects))
    bare = model.without("knee loss", "knee spring").joints[0]
    assert (bare.loss, bare.stiffness) == (None, 0.0)
    assert bare.faults() == []


def test_an_unknown_effect_offers_the_nearest_one():
    with pytest.raises(UnknownNameError, match="did you mean 'left knee loss'"):
        kneed_walker().without("left knee los")


def test_verbs_refuse_what_they_cannot_take():
    model = chain(1)
    joint = model.joints[0]
    with pytest.raises(ModelError, match="connect takes joints"):
        model.connect(joint.child.body)
    with pytest.raises(ModelError, match="constrain takes constraints"):
        model.constrain(joint)
    with pytest.raises(ModelError, match="controllers go to apply"):
        model.constrain(mbd.Controller("pd", lambda time, values, state: {}, period=0.1))
    with pytest.raises(ModelError, match="apply takes forces"):
        model.apply(mbd.Viscous(1.0))
    assert len(model.joints) == 1


def test_a_wrong_model_is_refused_at_once():
    with pytest.raises(ModelError, match="must be finite"):
        Model("walker", gravity=(0, math.nan, 0))
    with pytest.raises(ModelError, match="needs a name"):
        Model(None)


def test_a_model_pickles_as_its_description():
    model = kneed_walker()
    copy = pickle.loads(pickle.dumps(model))
    assert copy.describe() == model.describe()
    assert copy.check() == []
    assert copy.joints == model.joints
    assert copy.parameters == model.parameters


def test_the_description_names_everything():
    model = four_bar()
    model.apply(mbd.Motor("drive", model.joints[0], torque=1.0))
    text = model.describe()
    joint = "A: Revolute ground.origin → crank.start, A.angle [rad]"
    for told in ("four-bar", "crank: Link", joint, "drive: Motor", "mobility 1", "'C'"):
        assert told in text
    assert "faults" not in text
    model.apply(mbd.Motor("drive", model.joints[0], torque=1.0))
    assert "faults:" in model.describe()


def test_repr_counts():
    assert repr(four_bar()) == "Model('four-bar': 3 bodies, 4 joints, 0 forces, 0 constraints)"


def test_describing_a_model_loads_no_heavy_library():
    script = (
        "import sys; from tests.topology.mechanisms import kneed_walker; kneed_walker().parameters;"
        "print([m for m in ('sympy', 'scipy', 'matplotlib', 'networkx') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, timeout=300)
    assert done.stdout.strip() == "[]"


def test_steps_end_where_sampled_signals_have_a_kink():
    model = chain(1)
    joint = model.joints[0]
    model.apply(mbd.Motor("drive", joint, torque=mbd.Samples([0.0, 0.5, 2.0], [0, 1, 0], kind="linear")))
    model.apply(
        mbd.Applied("push", list(model.bodies.values())[-1].end, force=(mbd.Samples([0.1, 0.2, 0.3], [0, 1, 0]), 0.0))
    )
    run = mbd.simulate(model, mbd.assemble(model), dt=0.07, until=2.5)
    assert {0.1, 0.5} <= set(run.time)
    assert all(abs(run.time - end).min() < 1e-12 for end in (0.3, 2.0))  # behind the last sample


@pytest.mark.parametrize(
    "gravity", ["down", None, 3.0, (0.0, math.nan, 0.0), (0.0, 10**400, 0.0), (1.0, 2.0, 3.0, 4.0)]
)
def test_gravity_is_checked_alike_when_a_model_is_made_and_later(gravity):
    model = Model("m")
    with pytest.raises(ModelError, match="gravity of 'm'") as made:
        Model("m", gravity=gravity)
    with pytest.raises(ModelError) as changed:
        model.gravity = gravity
    assert str(made.value) == str(changed.value)
    model.gravity = [1, 2]
    assert model.gravity == Model("m", gravity=(1, 2)).gravity == (1.0, 2.0, 0.0)
