"""A force may be named like the spring that a joint could have: it acts all the same."""

import numpy as np
import pytest

import mbd
from mbd.equations.parameters import ParameterTable
from mbd.tape.node import Tape


def shank(name: str, own: float = 0.0) -> mbd.Model:
    """A link on a knee with a torsion spring of some name."""
    model = mbd.Model("shank", gravity=(0.0, 0.0, 0.0))
    link = mbd.Link("shank", mass=1.3, length=0.9, center=0.4, inertia=0.07)
    knee = mbd.Revolute("knee", model.ground.origin, link.start, stiffness=own)
    model.connect(knee)
    model.apply(mbd.TorsionSpring(name, knee, stiffness=5.0, rest=0.25))
    return model


def swing(model: mbd.Model) -> np.ndarray:
    start = mbd.assemble(model, position={"knee.angle": 1.0})
    return np.asarray(mbd.simulate(model, start, mbd.HHT(), dt=1e-3, until=1.0)["knee.angle"])


def test_a_spring_named_after_its_joint_pulls_like_any_other() -> None:
    band, spring = shank("band"), shank("knee spring")
    assert np.array_equal(swing(band), swing(spring))
    assert spring.parameters["knee spring.stiffness"] == 5.0
    assert mbd.simulate(
        spring, mbd.assemble(spring, position={"knee.angle": 1.0}), dt=1e-3, until=1.0,
        parameters={"knee spring.stiffness": 0.0},
    )["knee.angle"] == pytest.approx(1.0)  # fmt: skip


def test_it_can_be_left_out_by_that_name() -> None:
    assert swing(shank("knee spring").without("knee spring")) == pytest.approx(1.0)


def test_two_springs_of_one_name_are_refused() -> None:
    with pytest.raises(mbd.ModelError, match="'knee spring' is used 2 times"):
        mbd.assemble(shank("knee spring", own=2.0))


def test_one_parameter_cannot_have_two_values() -> None:
    table = ParameterTable(Tape())
    table.node("bob.mass", 2.0)
    table.node("bob.mass", 2.0)
    with pytest.raises(mbd.ModelError, match=r"two things have a parameter 'bob\.mass', 2 and 3"):
        table.node("bob.mass", 3.0)
