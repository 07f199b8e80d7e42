"""Numbers that no link has, and a ground that is a child, are told once with the value expected."""

import re
import warnings

import pytest

import mbd

RIGHT = {"mass": 8.0, "length": 0.42, "center": 0.18, "inertia": 0.13}


def told(turned=False, **wrong):
    """What is said of a thigh."""
    model, thigh = mbd.Model("leg"), mbd.Link("thigh", **{**RIGHT, **wrong})
    ends = (model.ground.origin, thigh.start)
    model.connect(mbd.Revolute("hip", *(ends[::-1] if turned else ends)))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        assert model.check() == []
        mbd.assemble(model, backend="python")
    assert len({str(each.message) for each in caught}) == len(caught), "once"
    return [str(each.message) for each in caught]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"mass": 8000.0}, "'thigh' has 8000 kg in 0.42 m, .* 8000 g is 8 kg"),
        ({"mass": 3400.0, "length": 0.35}, "3400 g is 3.4 kg"),
        ({"center": 1.8}, "center of mass of 'thigh' is 1.8 m .* outside its length of 0.42 m; .* 0.21 m for"),
        ({"center": 0.43}, "outside its length"),
        ({"center": -0.3}, "outside its length"),
        ({"inertia": 1300.0}, "inertia of 'thigh' is 1300 kg m², .* m L² = 1.41 kg m²; .* 0.118 kg m² for a uniform"),
        ({"inertia": (130.0, 0.1, 130.0)}, "inertia of 'thigh' is 130 kg m²"),
    ],
)  # fmt: skip
def test_what_no_link_has_is_told_with_what_it_may_have(wrong, said):
    sentences = told(**wrong)
    assert any(re.search(said, each) for each in sentences), sentences


@pytest.mark.parametrize("more", [{}, {"length": 0.0}, {"center": -0.1}, {"center": 0.42}, {"mass": 900.0, "length": 2.0}])  # noqa: E501  # fmt: skip
def test_what_links_have_is_not_told(more):
    assert told(**more) == []


def test_the_ground_as_a_child_is_told_with_the_line_to_write():
    (sentence,) = told(turned=True)
    assert "mbd.Revolute('hip', model.ground.origin, thigh.start)" in sentence and "opposite sign" in sentence


def test_the_ground_closes_a_loop_as_the_child():
    model = mbd.Model("four-bar")
    crank, coupler, rocker = (mbd.Link(name, 1.0, 1.0, 0.5, 0.1) for name in ("crank", "coupler", "rocker"))
    model.connect(
        mbd.Revolute("A", model.ground.origin, crank.start), mbd.Revolute("B", crank.end, coupler.start),
        mbd.Revolute("C", coupler.end, rocker.start), mbd.Revolute("D", rocker.end, model.ground.point(1.0, 0.0)),
    )  # fmt: skip
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        model.check()
