"""Every fault of a description is reported at once, by name, with what to try."""

import pytest

import mbd
from mbd.errors import ModelError
from mbd.model import Model
from tests.topology.mechanisms import bricard, chain, four_bar, kneed_walker


def one_fault(model: Model) -> str:
    (fault,) = model.check()
    with pytest.raises(ModelError):
        model.require_valid()
    return fault


@pytest.mark.parametrize("model", [chain(3), four_bar(), kneed_walker(), bricard(), kneed_walker(cut="all")], ids=repr)
def test_good_models_have_no_fault(model):
    assert model.check() == []
    model.require_valid()


def test_an_empty_model():
    assert "no joints" in one_fault(Model("empty"))


def test_a_disconnected_body_that_a_force_refers_to():
    model = chain(1)
    rope = mbd.PointMass("lost mass", 1.0)
    model.apply(mbd.Spring("rope", model.ground.origin, rope.origin, 1.0))
    fault = one_fault(model)
    assert "'lost mass'" in fault
    assert "'rope'" in fault


def test_bodies_that_hang_together_but_not_on_the_ground():
    model = chain(1)
    a, b = mbd.Link("a", 1.0, 1.0, 0.5), mbd.Link("b", 1.0, 1.0, 0.5)
    model.connect(mbd.Revolute("free hinge", a.end, b.start))
    faults = model.check()
    assert len(faults) == 2
    assert all("no chain of joints leads to the ground" in fault and "'free hinge'" in fault for fault in faults)


def test_all_faults_come_at_once():
    model = chain(2)
    bad = mbd.Link("bad", -1.0, 0.5, 0.2, inertia=(1.0, 1.0, 5.0))
    model.connect(mbd.Revolute("joint 1", model.ground.origin, bad.start, loss=mbd.Viscous(-1.0)))
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(bad.end), restitution=2.0, release=mbd.When("fot")))
    model.tunable = ("bad.mas",)
    text = "\n".join(model.check())
    for told in (
        "mass -1 kg is negative", "triangle inequality", "the name 'joint 1' is used 2 times", "feed energy in",
        "restitution 2", "no contact named 'fot'; did you mean 'foot'", "did you mean 'bad.mass'",
    ):  # fmt: skip
        assert told in text


def test_wrong_names_offer_the_nearest_one():
    model = kneed_walker()
    knee = model.joints[2]
    model.apply(mbd.Motor("drive", knee, torque=lambda a: a, arguments="left hop.angle"))
    model.constrain(mbd.Unilateral("stop", mbd.extension(knee), only_while="left fot"))
    model.constrain(mbd.Event("fall", mbd.measure("trunk.yy")))
    model.apply(mbd.Controller("brain", max, on="left fut", reads="left knee.rat", writes="left knee loss.coeff"))
    text = "\n".join(model.check())
    for told in ("'left hip.angle'", "'left foot'", "'trunk.y'", "'left knee.rate'", "'left knee loss.coefficient'"):
        assert f"did you mean {told}" in text


def test_a_joint_that_was_never_connected():
    model = chain(1)
    other = mbd.Revolute("other", model.ground.origin, model.joints[0].child.body.start)
    model.apply(mbd.Motor("drive", other, torque=1.0))
    assert "pass it to model.connect" in one_fault(model)


def test_two_bodies_of_one_name():
    model = chain(1)
    model.connect(mbd.Revolute("again", model.joints[0].child.body.end, mbd.Link("link 0", 1.0, 0.5, 0.25, 0.02).start))
    assert any("2 different bodies are named 'link 0'" in fault for fault in model.check())


def test_the_body_of_another_model_is_not_taken_for_ones_own():
    model, other = chain(2), chain(2)
    model.constrain(mbd.Unilateral("foot", mbd.touchdown(other.joints[1].child.body.end)))
    assert "2 different bodies are named 'link 1'" in one_fault(model)


def test_a_body_cannot_be_called_ground():
    model = chain(1)
    model.connect(mbd.Revolute("pin", model.joints[0].child.body.end, mbd.Link("ground", 1.0, 0.5, 0.2).start))
    assert any("named 'ground'" in fault for fault in model.check())


def test_a_loss_has_the_name_of_its_joint():
    model = kneed_walker()
    knee = model.joints[2]
    model.apply(mbd.TorsionSpring("left knee loss", knee, 1.0))
    assert "'left knee loss' is used 2 times" in one_fault(model)


def test_two_points_of_one_name():
    model = chain(1)
    rod = model.joints[0].child.body
    model.apply(
        mbd.Spring("s1", model.ground.origin, rod.point(0, 1, name="toe"), 1.0),
        mbd.Spring("s2", model.ground.origin, rod.point(0, 2, name="toe"), 1.0),
    )
    assert "two different points are named 'link 0.toe'" in one_fault(model)


def test_a_joint_from_a_body_to_itself():
    model = chain(1)
    rod = model.joints[0].child.body
    model.connect(mbd.Revolute("self", rod.start, rod.end))
    assert "connects 'link 0' to itself" in one_fault(model)


def test_a_mass_that_may_spin_about_its_own_point():
    model = chain(1)
    bob = mbd.PointMass("bob", 1.0)
    model.connect(mbd.Revolute("pin", model.joints[0].child.body.end, bob.origin))
    assert "'bob' may spin" in one_fault(model)
    model = chain(1)
    model.connect(mbd.Weld("pin", model.joints[0].child.body.end, bob.origin))
    assert model.check() == []


def test_a_massless_end_of_the_tree():
    model = chain(1)
    tip = mbd.Link("tip", 0.0, 0.1, 0.05)
    model.connect(mbd.Revolute("pin", model.joints[0].child.body.end, tip.start))
    assert "neither mass nor inertia" in one_fault(model)
    model.constrain(mbd.Bilateral("slot", mbd.height(tip.end), value=-0.5))
    assert model.check() == []


def test_a_massless_body_between_others_is_left_to_the_assembly():
    model = Model("hip without mass")
    hip, leg = mbd.PointMass("hip", 0.0), mbd.Link("leg", 1.0, 1.0, 0.5, 0.1)
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin), mbd.Revolute("pin", hip.origin, leg.start))
    assert model.check() == []


def test_a_point_mass_on_a_thread_is_moved_by_it():
    model = Model("nut")
    model.connect(mbd.Screw("thread", model.ground.origin, mbd.PointMass("nut mass", 1.0).origin, pitch=0.01))
    assert model.check() == []
