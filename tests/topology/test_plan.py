"""Spanning trees, cut joints, floating bodies, mobility."""

import numpy as np
import pytest

import mbd
from mbd.errors import ModelError
from mbd.model import Model
from mbd.topology import disconnected, graph_of, mobility, plan
from tests.topology.mechanisms import bricard, chain, four_bar, kneed_walker


def names(joints) -> list[str]:
    return [joint.name for joint in joints]


def test_a_tree_keeps_every_joint():
    chosen = plan(kneed_walker())
    assert names(chosen.edges) == ["trunk", "left hip", "right hip", "left knee", "right knee"]
    assert chosen.cut == chosen.floating == chosen.notes == ()
    assert (chosen.dof, chosen.mobility, chosen.planar) == (6, 6, True)


@pytest.mark.parametrize("cut", ["auto", "loops"])
def test_a_loop_is_cut_where_it_closes(cut):
    chosen = plan(four_bar(cut))
    assert names(chosen.edges) == ["A", "D", "B"]
    assert names(chosen.cut) == ["C"]
    assert chosen.mobility == 1
    assert "'C'" in chosen.notes[0]


def test_a_named_joint_is_cut_instead():
    chosen = plan(four_bar(["B"]))
    assert names(chosen.cut) == ["B"]
    assert names(chosen.edges) == ["A", "D", "C"]
    assert chosen.edges[2].is_reversed


def test_a_joint_described_from_its_child_is_walked_backwards():
    chosen = plan(chain(3, reverse=True))
    assert names(chosen.edges) == ["joint 0", "joint 1", "joint 2"]
    assert all(joint.is_reversed for joint in chosen.edges)
    assert names([joint.parent.body for joint in chosen.edges]) == ["ground", "link 0", "link 1"]
    assert chosen.coordinate_names == ("joint 0.angle", "joint 1.angle", "joint 2.angle")


@pytest.mark.parametrize("cut", ["auto", "all", ["joint 1"], ["joint 0", "joint 2"]], ids=str)
@pytest.mark.parametrize("reverse", [False, True])
def test_every_body_is_reached_once_and_each_joint_used_once(cut, reverse):
    model = chain(4, cut, reverse)
    chosen = plan(model)
    known = {"ground"}
    for joint in chosen.edges:
        assert joint.parent.body.name in known
        assert joint.child.body.name not in known
        known.add(joint.child.body.name)
    assert known == set(model.bodies)
    used = names(j for j in chosen.edges if j not in chosen.floating) + names(chosen.cut)
    assert sorted(used) == names(model.joints)
    freedoms = chosen.dof - sum(3 - len(joint.labels) for joint in chosen.cut)
    assert freedoms == chosen.mobility == 4


def test_cutting_all_lets_every_body_float():
    chosen = plan(kneed_walker(cut="all"))
    assert names(chosen.cut) == ["trunk", "left hip", "left knee", "right hip", "right knee"]
    assert names(chosen.edges) == names(chosen.floating)
    assert chosen.coordinate_names[:3] == ("hip floating.x", "hip floating.y", "left thigh floating.x")
    assert chosen.dof == 14


def test_a_body_that_is_cut_off_carries_what_hangs_on_it():
    chosen = plan(chain(4, ["joint 1"]))
    assert names(chosen.edges) == ["joint 0", "link 1 floating", "joint 2", "joint 3"]
    assert names(chosen.path("link 3")) == ["link 1 floating", "joint 2", "joint 3"]
    assert chosen.path("ground") == ()


def test_a_point_mass_welded_to_a_rod_floats_with_its_axes():
    """A mass that could not turn would keep the rod from turning."""
    model = chain(1, "all")
    bob = mbd.PointMass("bob", 1.0)
    model.connect(mbd.Weld("weld", model.joints[0].child.body.end, bob.origin))
    assert isinstance(plan(model).edges[1], mbd.Planar)


@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 0.2)])
def test_a_point_mass_on_an_arm_turns_with_it_however_it_is_cut(axis):
    ends = []
    for cut in ("auto", "all"):
        model = mbd.Model("arm", cut=cut)
        bob = mbd.PointMass("bob", 1.0)
        model.connect(mbd.Revolute("pin", model.ground.origin, bob.point(0.0, 1.0, 0.0), axis=axis))
        start = mbd.assemble(model, {"pin.angle": 0.5})
        ends.append(mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.2)["bob.center"][-1])
    assert ends[0] == pytest.approx(ends[1], abs=1e-10)


@pytest.mark.parametrize("cut", ["all", ["lower"]])
def test_bodies_of_a_planar_mechanism_float_in_the_planes_where_joints_hold_them(cut):
    """Layers of a linkage lie at different heights z, which follow the parameters of their pins."""
    ends = []
    for each in ("auto", cut):
        model = mbd.Model("layers", cut=each)
        rod, bob = mbd.RigidBody("rod", 1.0, 0.1), mbd.PointMass("bob", 1.0)
        post = model.ground.point(0.1, 0.2, 0.3, name="post")
        model.connect(
            mbd.Revolute("upper", post, rod.point(0.0, 0.5, 0.0, name="hole")),
            mbd.Revolute("lower", rod.point(1.0, 0.0, -0.1), bob.point(0.0, 0.4, 0.2)),
        )
        for parameters in ({}, {"ground.post.z": 0.7, "rod.hole.z": -0.1}):
            start = mbd.assemble(model, {"upper.angle": 0.3, "lower.angle": 1.0}, parameters=parameters)
            run = mbd.simulate(model, start, mbd.RungeKutta853(), dt=0.01, until=0.2)
            ends.append([*run["rod.origin"][-1], *run["bob.origin"][-1]])
    assert np.array(ends[:2]) == pytest.approx(np.array(ends[2:]), abs=1e-10)
    assert ends[2][5] == pytest.approx(0.0, abs=1e-15)
    assert ends[3][5] == pytest.approx(0.5, abs=1e-15)


def test_a_spatial_body_floats_with_all_six_motions():
    model = bricard()
    model.cut = "all"
    chosen = plan(model)
    assert {type(joint) for joint in chosen.floating} == {mbd.Free}
    assert chosen.dof == 6 * len(chosen.bodies)
    assert len(chosen.coordinate_names) == 7 * len(chosen.bodies)


def test_mobility_by_the_count_of_gruebler():
    assert plan(bricard()).mobility == 0
    assert not plan(bricard()).planar
    assert mobility(3, four_bar().joints, planar=True) == 1
    assert mobility(3, four_bar().joints, planar=False) == -2


def test_turned_frames_decide_whether_a_mechanism_is_planar():
    for axis, expected in ((0, 0, 1), True), ((1, 0, 0), False):
        model = Model("turned")
        rod = mbd.Link("rod", 1.0, 0.5, 0.2, (0.1, 0.1, 0.1))
        model.connect(mbd.Revolute("pin", model.ground.origin.turned(0.3, axis), rod.start))
        assert plan(model).planar is expected


def test_two_joints_between_two_bodies_make_a_loop():
    model = chain(1)
    rod = model.joints[0].child.body
    model.connect(mbd.Prismatic("slot", model.ground.point(0.0, -0.5), rod.end, axis=(0, 1, 0)))
    assert names(plan(model).cut) == ["slot"]


def test_an_unknown_cut_offers_the_nearest_joint():
    with pytest.raises(ModelError, match="did you mean 'joint 1'"):
        plan(chain(3, ["joint1"]))
    with pytest.raises(ModelError, match="'auto', 'loops', 'all'"):
        plan(chain(3, "some"))


def test_the_graph_can_be_asked():
    graph = graph_of(four_bar())
    assert list(graph) == ["ground", "crank", "coupler", "rocker"]
    assert graph.number_of_edges() == 4
    assert disconnected(four_bar()) == []


def test_long_chains_are_planned_in_proportion():
    chosen = plan(chain(400))
    assert chosen.dof == 400
    assert len(chosen.path("link 399")) == 400
