"""What is absent costs nothing, and changes nothing."""

import pytest

import mbd
from mbd.equations import derive
from mbd.equations.cost import operations
from mbd.equations.programs import ActiveSet, newton, residual
from mbd.tape.derivatives import live
from tests.equations.mechanisms import leg


def pendulum(tunable=(), loss=None, stiffness=0.0, gravity=(0.0, -9.81, 0.0), inertia=0.02) -> mbd.Model:
    model = mbd.Model("pendulum", gravity=gravity, tunable=tunable)
    rod = mbd.Link("rod", mass=2.0, length=0.7, center=0.3, inertia=inertia)
    tip = mbd.Link("tip", mass=0.5, length=0.4, center=0.2, inertia=inertia)
    pin = mbd.Revolute("pin", model.ground.origin, rod.start, loss=loss, stiffness=stiffness)
    model.connect(pin, mbd.Revolute("hinge", rod.end, tip.start))
    return model


def count(model) -> tuple[int, int]:
    equations = derive(model)
    active = ActiveSet(stabilized=False)
    return operations(newton(equations, active)), operations(residual(equations, active))


BARE = count(pendulum())


@pytest.mark.parametrize("extra", [{"loss": mbd.Viscous(0.0)}, {"loss": mbd.Quadratic(0.0)}, {"stiffness": 0.0}])
def test_an_effect_with_an_exact_zero_costs_no_operation(extra):
    assert count(pendulum(**extra)) == BARE


def test_a_force_that_is_an_exact_zero_costs_no_operation():
    model = pendulum()
    rod = model.joints[0].child.body
    model.apply(
        mbd.Applied("push", rod.end, force=(0.0, 0.0)),
        mbd.Spring("spring", model.ground.origin, rod.center, stiffness=0.0, length=0.1),
        mbd.Motor("drive", model.joints[0], torque=0.0),
        mbd.Potential("nothing", lambda angle: 0.0, arguments=("pin.angle",)),
    )
    assert count(model) == BARE
    assert [effect.name for effect in derive(model).effects] == ["gravity"]


def test_an_effect_costs_something_and_its_absence_is_the_bare_model():
    assert count(pendulum(loss=mbd.Viscous(0.1))) > BARE
    assert count(pendulum(loss=mbd.Viscous(0.1)).without("pin loss")) == BARE
    assert count(pendulum(gravity=(0.0, 0.0, 0.0))) < BARE
    assert count(pendulum(inertia=0.0)) < BARE


def test_contacts_that_are_open_cost_nothing_in_a_step():
    model = pendulum()
    model.constrain(
        mbd.Unilateral("tip down", mbd.touchdown(model.joints[1].child.body.end)),
        mbd.Penalty("stop", mbd.flexion(model.joints[1]), stiffness=100.0),
    )
    assert count(model) == BARE


def test_an_unasked_result_leaves_the_equations_alone():
    model = leg()
    asked, silent = derive(model), derive(model)
    for name in asked.output_names():
        asked.output(name)
    rows = range(len(asked.rows))
    for program in residual, newton:
        active = ActiveSet(rows, [2])
        assert operations(program(asked, active)) == operations(program(silent, active))
    assert asked.parameters == silent.parameters


def test_planar_models_have_no_third_dimension():
    """Nothing of a planar model depends on what only space has; a point mass has no inertia."""
    equations = derive(leg())
    assert not any(row.part == "sideways" for row in equations.rows)
    assert equations.output("shank.end.z").is_zero
    assert equations.output("knee.reaction_force.z").is_zero


def test_structural_zeros_are_no_parameters_unless_tunable():
    fixed, tuned = derive(pendulum()), derive(pendulum(tunable=("pin spring.stiffness", "gravity.x")))
    assert "gravity.x" not in [parameter.name for parameter in fixed.parameters]
    names = {parameter.name: parameter.value for parameter in tuned.parameters}
    assert names["pin spring.stiffness"] == 0.0
    assert names["gravity.x"] == 0.0
    inputs = {node.data for node in live(residual(tuned, ActiveSet((), (), False))) if node.op == "input"}
    assert ("p", list(names).index("gravity.x")) in inputs


def test_every_parameter_of_the_words_is_an_input_or_structural():
    model = leg()
    names = {parameter.name: parameter.value for parameter in derive(model).parameters}
    for name, value in model.parameters.items():
        assert names.get(name, value) == value
        if value not in (0.0, 1.0, -1.0) and not name.endswith("spring.rest"):
            assert name in names, name
