"""Named results, the stick figure, print and cost."""

import numpy as np
import pytest

import mbd
from mbd.equations import derive
from mbd.equations.programs import ActiveSet
from tests.equations.mechanisms import four_bar, furnished, leg, random_tree, walker
from tests.equations.numbers import at, derivative, inputs


def value(equations, name, point):
    return at([equations.output(name)], point)[0]


@pytest.mark.parametrize("make", [leg, walker, four_bar, lambda: furnished(random_tree(5, 3, spatial=True), 2)])
def test_every_name_that_is_offered_has_a_value(make):
    equations = derive(make())
    names = equations.output_names()
    assert len(names) == len(set(names))
    values = at([equations.output(name) for name in names], inputs(equations, 1))
    assert np.isfinite(values).all()


def test_every_quantity_that_words_may_ask_for_is_a_result():
    from mbd.topology.check import quantities

    for model in (leg(), four_bar("all")):
        equations = derive(model)
        assert set(quantities(model)) <= set(equations.output_names())


def test_results_of_the_leg():
    equations = derive(leg())
    point = inputs(equations, 2)
    x, y, hip, knee = (point["q", k] for k in range(4))
    assert value(equations, "knee.angle", point) == knee
    assert value(equations, "knee.rate", point) == value(equations, "knee.angle.rate", point) == point["v", 3]
    assert value(equations, "knee.acceleration", point) == point["a", 3]
    assert value(equations, "trunk.x", point) == x
    foot = np.array([x, y]) + 0.5 * np.array([np.sin(hip), -np.cos(hip)])
    foot += 0.45 * np.array([np.sin(hip + knee), -np.cos(hip + knee)])
    np.testing.assert_allclose([value(equations, f"shank.end.{axis}", point) for axis in "xy"], foot, rtol=1e-13)
    drive = 0.3 * np.sin(2.0 * point["t", 0]) * knee
    assert value(equations, "drive.torque", point) == pytest.approx(drive)
    assert value(equations, "drive.power", point) == pytest.approx(drive * point["v", 2])
    assert value(equations, "knee spring.energy", point) == pytest.approx(0.5 * 3.0 * (knee + 0.2) ** 2)
    assert value(equations, "stop.power", point) == pytest.approx(
        value(equations, "stop.force", point) * value(equations, "stop.gap_rate", point)
    )
    assert value(equations, "stop.force", point | {("switch", 2): 0.0}) == 0.0


def test_velocities_are_the_rates_of_places():
    equations = derive(furnished(random_tree(11, 4, spatial=True), 1))
    point = inputs(equations, 3)
    motion = {("x", k): point["v", k] for k in range(equations.n_v)}
    names = [name for name in equations.output_names() if name.startswith("body") and name.endswith(".x")]
    frames = [name.removesuffix(".x") for name in names]
    assert len(frames) > 6
    for frame in frames:
        places = [equations.output(f"{frame}.{axis}") for axis in "xyz"]
        rates = at([equations.output(f"{frame}.v{axis}") for axis in "xyz"], point)
        np.testing.assert_allclose(rates, derivative(places, point, motion), atol=1e-7)


def test_a_wrong_name_offers_the_nearest():
    equations = derive(walker())
    with pytest.raises(mbd.UnknownNameError, match=r"did you mean 'left hip\.angle'"):
        equations.output("left hop.angle")


def test_a_cut_joint_has_the_results_of_any_joint():
    equations = derive(four_bar(cut=["A"]))
    point = inputs(equations, 4)
    change = derivative([equations.output("A.rate")], point, {("v", k): point["a", k] for k in range(3)})
    still = point | {("v", k): 0.0 for k in range(3)}
    assert value(equations, "A.acceleration", still) == pytest.approx(change[0], abs=1e-7)
    assert "A.x.multiplier" in equations.output_names()
    assert not any("floating.reaction" in name for name in derive(four_bar("all")).output_names())


def test_the_figure_joins_known_frames():
    for make in (leg, walker, four_bar, lambda: furnished(random_tree(5, 3, spatial=True), 2)):
        model = make()
        equations = derive(model)
        figure = equations.figure()
        assert {body for body, _ in figure} == set(model.bodies)
        for body, frames in figure:
            for frame in frames:
                equations.output(f"{body}.{frame}.x")
    assert ("left thigh", ("start", "end")) in derive(walker()).figure()
    assert ("hip", ("origin",)) in derive(walker()).figure()


def test_equations_print_as_text_with_users_names():
    text = leg().equations()
    assert "M[knee.angle, knee.angle] = " in text
    assert "knee_spring.stiffness*(knee.angle - knee_spring.rest)" in text
    assert "B[foot.normal, trunk.y] = 1" in text
    assert "operations: M " in text


def test_equations_print_as_latex():
    model = mbd.Model("pendulum")
    rod = mbd.Link("rod", mass=2.0, length=0.7, center=0.3, inertia=0.02)
    model.connect(mbd.Revolute("pin", model.ground.origin, rod.start, loss=mbd.Viscous(0.1)))
    text = model.equations(latex=True)
    assert r"M_{1\,1} &= J_{\mathrm{rod}} + c_{\mathrm{rod}}^{2} m_{\mathrm{rod}}" in text
    assert r"d_{\mathrm{pin~loss}}" in text
    assert "g_{y}" in text
    assert "% q_1 = pin.angle [rad]" in text
    assert walker().equations(latex=True).count("w_{1} &=") == 1


def test_cost_tells_operations_by_effect():
    cost = leg().cost()
    assert set(cost.effects) == {
        "gravity", "trunk loss", "hip joint loss", "knee spring", "knee loss", "drive", "ankle-like",
    }  # fmt: skip
    assert all(count > 0 for count in cost.effects.values())
    assert all(count > 0 for count in cost.contacts.values())
    assert cost.residual < cost.newton
    assert "knee loss" in repr(cost)


def test_small_programs_stay_small():
    """Operation counts that a change should move knowingly: (Newton iteration of index 3, residual)."""
    from mbd.equations.cost import operations
    from mbd.equations.programs import newton, residual

    counts = {}
    for name, make, rows in (("walker", walker, (0, 1, 2, 5)), ("four-bar", four_bar, (0, 1))):
        equations = derive(make())
        counts[name] = [operations(p(equations, ActiveSet(rows, (), False))) for p in (newton, residual)]
    assert counts["walker"][0] <= 416
    assert counts["walker"][1] <= 153
    assert counts["four-bar"][0] <= 370
    assert counts["four-bar"][1] <= 147


@pytest.mark.parametrize("make", [leg, four_bar, lambda: furnished(random_tree(5, 3, spatial=True), 2)])
def test_only_the_inputs_of_the_contract_are_left(make):
    from mbd.equations.programs import accelerations, guards, newton, scales
    from mbd.tape.derivatives import live

    equations = derive(make())
    rows = range(len(equations.rows))
    nodes = [*accelerations(equations), *guards(equations), *scales(equations), *newton(equations, ActiveSet(rows))]
    nodes += [equations.output(name) for name in equations.output_names()]
    nodes += [node for effect in equations.effects for node in effect.generalized()]
    kinds = {node.data[0] for node in live(nodes) if node.op == "input"}
    assert kinds <= {"t", "c", "q", "x", "v", "a", "z", "s", "lam", "anchor", "switch", "p"}
