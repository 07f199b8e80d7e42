"""What one table calls round-off, half of all digits and nominally equal is what those who use it go by."""

import numpy as np
import pytest

import mbd
from mbd.assembly.dependence import rank_of
from mbd.assembly.posture import _involved


def test_a_row_acts_on_what_it_changes_by_more_than_the_round_off_of_a_few_terms():
    assert _involved(np.array([[3e-14, 3e-15]]), np.array([True, True])).tolist() == [0]


@pytest.mark.parametrize(("left", "rank"), [(1e-7, 2), (1e-9, 1)])
def test_a_row_of_which_less_than_half_of_all_digits_are_left_beside_another_depends_on_it(left, rank):
    assert rank_of(np.array([[1.0, 0.0], [1.0, left]])) == rank


@pytest.mark.parametrize("off", [1e-7, 1e-5])
def test_an_orientation_that_was_rounded_as_it_was_written_is_taken(off):
    model = mbd.Model("ball joint")
    model.connect(mbd.Spherical("hip", model.ground.origin, mbd.RigidBody("leg", 1.0, (1.0, 2.0, 2.5)).origin))
    given = {"hip.orientation": (1.0 + off, 0.0, 0.0, 0.0)}
    if off < 1e-6:
        assert mbd.assemble(model, given)["hip.orientation"][0] == 1.0
        return
    with pytest.raises(mbd.MbdError, match="length"):
        mbd.assemble(model, given)
