"""The strategies draw what they say, and the laws hold for what they draw."""

import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.equations import derive
from mbd.testing import check_model, frames, loops, postures, random_scene, random_tree, scenes, states, trees
from mbd.testing.numbers import at, inputs

few = settings(max_examples=6)
BODY = mbd.RigidBody("body", 1.0, (1.0, 1.0, 1.0))


@given(names=postures("hip.angle", "knee.angle", size=0.5))
def test_postures_are_numbers_by_name(names):
    assert set(names) == {"hip.angle", "knee.angle"}
    assert max(map(abs, names.values())) <= 0.5


@given(flat=frames(BODY), deep=frames(BODY, spatial=True))
def test_frames_belong_to_their_body(flat, deep):
    assert flat.body is deep.body is BODY
    assert flat.offset[2] == 0.0
    if flat.rotation is not None:
        assert np.array(flat.rotation)[2] == pytest.approx([0.0, 0.0, 1.0])


@few
@given(tree=trees(bodies=3, spatial=False, most=4))
def test_planar_trees_are_valid_and_small(tree):
    assert tree.check() == []
    assert all(joint.is_planar for joint in tree.joints)
    assert 1 <= derive(tree).n_q <= 4


@few
@given(drawn=loops(bars=4))
def test_loops_close_at_their_angles(drawn):
    model, angles = drawn
    equations = derive(model)
    point = inputs(equations) | {("q", k): angles[c.name] for k, c in enumerate(equations.coordinates)}
    assert len(equations.rows) == 2
    np.testing.assert_allclose(at([row.value for row in equations.rows], point), 0.0, atol=1e-12)
    check_model(model, postures=1)


@few
@given(scene=scenes(bodies=3), data=st.data())
def test_scenes_have_contacts_and_consistent_states(scene, data):
    assert scene.check() == []
    assert scene.contacts
    state = data.draw(states(scene))
    assert np.isfinite(state.q).all()
    assert not state.mode.closed


@few
@given(data=st.data(), drawn=loops(bars=3))
def test_states_of_a_loop_satisfy_its_rows(data, drawn):
    model, angles = drawn
    state = data.draw(states(model, around=angles, size=0.02))
    terms = mechanism_of(model, "python")
    equations = terms.equations
    point = inputs(equations) | {("q", k): float(q) for k, q in enumerate(state.q)} | {("t", 0): state.time}
    point |= {("v", k): float(v) for k, v in enumerate(state.v)}
    np.testing.assert_allclose(at([row.value for row in equations.rows], point), 0.0, atol=1e-8)
    np.testing.assert_allclose(at([row.rate for row in equations.rows], point), 0.0, atol=1e-8)


def test_the_same_seed_makes_the_same_mechanism():
    assert random_scene(7).describe() == random_scene(7).describe()
    assert random_tree(7, 3, True).describe() == random_tree(7, 3, True).describe()


def fresh(program: str) -> str:
    words = [sys.executable, "-c", program]
    return subprocess.run(words, capture_output=True, text=True, check=True, timeout=300).stdout


def test_the_kit_loads_lazily_and_checks_need_no_hypothesis():
    program = """
import sys, mbd
assert "mbd.testing" not in sys.modules
mbd.testing.check_loss(mbd.Viscous(0.1), rates=4)
assert "hypothesis" not in sys.modules
sys.modules["hypothesis"] = None
try:
    mbd.testing.trees()
except mbd.MbdError as error:
    print(error)
"""
    assert "python -m pip install 'mbd[test]'" in fresh(program)


def test_a_wrong_name_offers_the_right_ones():
    with pytest.raises(AttributeError, match="check_joint"):
        mbd.testing.check_joints
