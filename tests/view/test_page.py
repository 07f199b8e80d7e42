"""The page: what it holds, that it needs nothing else, and that it plays."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import mbd
from mbd.results.trajectory import Trajectory
from mbd.view.instants import Instants
from mbd.view.page import packed
from mbd.view.scene import scene, upright
from tests.simulation.mechanisms import kneed_walker, kneed_walker_start
from tests.view.handmade_runs import Sheet, ball, oscillator, record, walker
from tests.view.pages import Elements, opened


def page(run: Trajectory, folder: Path) -> tuple[str, dict]:
    text = run.page(folder / "page.html").read_text(encoding="utf-8")
    return text, json.loads(Elements(text).scripts[0])


def unpacked(series: dict, count: int) -> np.ndarray:
    return np.cumsum(np.concatenate([series["d"], np.zeros(count - len(series["d"]))])) * series["step"]


def test_the_page_needs_nothing_from_elsewhere(tmp_path):
    text, _ = page(walker(), tmp_path)
    elements = Elements(text)
    loads = [attributes for _, attributes in elements.tags if attributes.keys() & {"src", "href", "srcset", "action"}]
    assert not loads and not re.search(r"https?://|@import|url\(|fetch\(|XMLHttpRequest|import\(", text)
    policy = [attributes["content"] for tag, attributes in elements.tags if attributes.get("http-equiv")]
    assert policy == ["default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'"]
    assert len(elements.scripts) == 2 and "prefers-color-scheme: dark" in text
    assert not re.search(r"<!--\w+-->|/\*(style|data|script)\*/", text)


def test_the_page_of_six_seconds_is_small(tmp_path):
    run = walker(steps=12, period=0.5, dt=0.001)
    path = run.page(tmp_path / "deep" / "page.html")
    assert path.stat().st_size < 300_000


def test_the_page_holds_the_motion(tmp_path):
    run = walker()
    _, data = page(run, tmp_path)
    time = np.array(data["time"])
    names = [point["name"] for point in data["points"]]
    foot = data["points"][names.index("left leg.end")]["at"]
    x, y = (unpacked(series, len(time)) for series in foot)
    slope = 0.05
    true = run.at(time)["left leg.end"]
    np.testing.assert_allclose(x, true[:, 0] * np.cos(slope) + true[:, 1] * np.sin(slope), atol=1e-3)
    np.testing.assert_allclose(y, true[:, 1] * np.cos(slope) - true[:, 0] * np.sin(slope), atol=1e-3)
    assert [s["body"] for s in data["segments"]] == ["hip", "left leg", "right leg"]
    assert [s["side"] for s in data["segments"]] == ["", "left", "right"] and data["segments"][0]["mass"] == 1.0


def test_gravity_points_down_the_page_and_the_slope_is_drawn_tilted(tmp_path):
    run = walker(slope=0.05)
    g = np.array([run.parameters["gravity.x"], run.parameters["gravity.y"], 0.0])
    np.testing.assert_allclose(upright(run) @ g, [0.0, -9.81, 0.0], atol=1e-12)
    _, data = page(run, tmp_path)
    (ground,) = data["grounds"]
    np.testing.assert_allclose(ground["normal"], [np.sin(0.05), np.cos(0.05), 0.0], atol=1e-8)
    assert ground["offset"] == 0.0


def test_footprints_lie_on_the_ground_where_feet_stood(tmp_path):
    run = walker(steps=5)
    _, data = page(run, tmp_path)
    assert [touch["side"] for touch in data["touches"]] == ["left"] * 3 + ["right"] * 2
    normal = np.array(data["grounds"][0]["normal"])[:2]
    for touch in data["touches"]:
        assert abs(normal @ touch["where"]) < 1e-5 and touch["end"] - touch["begin"] == pytest.approx(0.5)


def test_the_forces_drawn_are_those_that_move_the_mechanism(tmp_path):
    """Newton's law for the whole: Σ F = Σ m (a − g), of feet that stick and change over."""
    model = kneed_walker()
    run = mbd.simulate(model, kneed_walker_start(model), mbd.HHT(alpha=0.05), dt=1e-3, until=0.7)
    _, data = page(run, tmp_path)
    time = np.array(data["time"])
    assert [push["name"] for push in data["pushes"]] == ["left foot", "right foot"]
    total = sum(np.array([unpacked(axis, len(time)) for axis in push["force"]]) for push in data["pushes"])
    switches = [0.0, *(event.time for event in run.events), 0.7]
    calm = np.min(np.abs(time[:, None] - switches), axis=1) > 0.02
    late, early = run.at(time[calm] + 2e-3), run.at(time[calm] - 2e-3)
    g = np.array([run.parameters.get(f"gravity.{axis}", 0.0) for axis in "xyz"])
    masses = {name.removesuffix(".mass"): mass for name, mass in run.parameters.items() if name.endswith(".mass")}
    inertial = sum(
        mass * (np.stack([(late[name] - early[name]) / 4e-3 for name in velocity], axis=1) - g)
        for body, mass in masses.items()
        for velocity in [[f"{body}.center.v{axis}" for axis in "xyz"]]
    )
    np.testing.assert_allclose(total[:, calm].T, (inertial @ upright(run).T)[:, :2], atol=2e-3 * np.max(total))


def test_forces_and_powers_have_curves_and_angles_are_in_degrees(tmp_path):
    _, data = page(walker(), tmp_path)
    units = [chart["unit"] for chart in data["charts"]]
    assert "N" in units and "°" in units and not any("rad" in unit for unit in units)
    assert data["spin"]["rate"] > 0.0 and [contact["foot"] for contact in data["contacts"]] == [True, True]


def test_samples_are_one_line_among_the_events_with_their_number(tmp_path):
    model = mbd.Model("held")
    arm = mbd.Link("arm", mass=1.0, length=0.5, center=0.25, inertia=0.02)
    hinge = mbd.Revolute("hinge", model.ground.origin, arm.start)
    model.connect(hinge)
    model.apply(
        mbd.Motor("motor", hinge, torque=0.0),
        mbd.SampledLaw("PD", 0.01, {"motor.torque": lambda q: -20.0 * q}, arguments=("hinge.angle",), delay=0.004),
        mbd.Event("level", mbd.measure(lambda angle: angle - 0.1, "hinge.angle")),
    )  # fmt: skip
    run = mbd.simulate(model, mbd.assemble(model, {"hinge.angle": 0.3}), mbd.HHT(), dt=1e-3, until=1.0)
    _, data = page(run, tmp_path)
    for name in "PD: sample", "PD: output":
        own = [event for event in run.events if event.name == name]
        (line,) = [event for event in data["events"] if event["name"].startswith(name)]
        assert line["name"] == f"{name} × {len(own)}" and len(own) >= 99
        assert line["time"] == own[0].time
    others = [event.time for event in run.events if event.name == "level"]
    assert [event["time"] for event in data["events"] if event["name"] == "level"] == others and others
    assert len(data["events"]) == 2 + len(others)


def test_contacts_events_and_energies_share_the_clock(tmp_path):
    run = ball(bounces=2)
    _, data = page(run, tmp_path)
    assert [event["kind"] for event in data["events"]] == [event.kind for event in run.events]
    assert data["contacts"][0]["closed"] == [[run.events[-1].time, float(run.time[-1])]]
    energy, time = data["charts"][0], np.array(data["time"])
    assert [line["name"] for line in energy["series"]] == ["total", "kinetic", "potential", "lost"]
    total, _, _, lost = (unpacked(line["values"], len(time)) for line in energy["series"])
    np.testing.assert_allclose(total + lost, total[0], atol=5e-3 * total[0])
    strike = np.flatnonzero(np.isclose(time, run.events[0].time, atol=1e-9))
    assert len(strike) == 2 and total[strike[0]] > total[strike[1]]


def test_a_model_without_a_figure_still_has_its_histories(tmp_path):
    run = oscillator()
    assert run.record.equations is not None
    run.record.equations.figure = None
    _, data = page(run, tmp_path)
    assert data["points"] == [] and data["charts"][1]["unit"] == "m"
    assert data["charts"][1]["series"][0]["name"] == "slider.displacement"


def test_a_spatial_motion_keeps_its_depth(tmp_path):
    sheet = Sheet(1)
    coordinates = sheet.coordinates("turn.angle")
    from mbd.tape.functions import cos, sin

    sheet.point("rod.start", 0.0, 0.0)
    sheet.point("rod.end", cos(sheet.q[0]), 0.0)
    sheet.outputs["rod.end.z"] = -sin(sheet.q[0])
    equations = sheet.equations(
        "turntable", coordinates, 0.5 * sheet.v[0] ** 2, sheet.tape.zero, figure=[("rod", ["start", "end"])]
    )
    t = np.linspace(0.0, 1.0, 101)[:, None]
    _, data = page(Trajectory(record(equations, t[:, 0], 6.0 * t, 6.0 + 0.0 * t, 0.0 * t)), tmp_path)
    assert data["spatial"] and len(data["points"][1]["at"]) == 3


def test_names_cannot_break_out_of_the_page(tmp_path):
    run = oscillator()
    assert run.record.equations is not None
    run.record.equations.name = "</script><b>/*script*/"
    text, data = page(run, tmp_path)
    assert data["name"] == "</script><b>/*script*/" and "</script><b>" not in text


def test_a_loaded_run_makes_the_same_page(tmp_path):
    run = walker()
    again = mbd.load(run.save(tmp_path / "run"))
    _, first = page(run, tmp_path)
    _, second = page(again, tmp_path)
    for live, stored in zip(first.pop("points"), second.pop("points"), strict=True):
        for one, other in zip(live["at"], stored["at"], strict=True):
            count = len(first["time"])
            np.testing.assert_allclose(unpacked(one, count), unpacked(other, count), atol=2.1 * one["step"])
    assert first == second


def test_series_are_packed_to_a_step_and_back():
    values = np.array([1.0, 1.5, -2.25, -2.25])
    np.testing.assert_allclose(unpacked(packed(values, 0.25), 4), values)
    assert packed([3.0, 3.0, 3.0], 0.5) == {"step": 0.5, "d": [6]}
    assert packed([np.nan, 1.0], 1.0)["d"] == [0, 1]


def test_instants_show_both_sides_of_an_event():
    run = ball()
    instants = Instants.of(run, 100)
    strike = run.events[0].time
    found = np.flatnonzero(instants.time == strike)
    assert instants.after[found].tolist() == [False, True]
    rates = instants.read(run, ["flight.y.rate"])[found, 0]
    assert rates[0] < 0.0 < rates[1]
    np.testing.assert_allclose(instants.blend(run, run["flight.y.rate"])[found], rates)


def test_an_inclined_ground_is_found_from_the_motion():
    """gap = n·p − d with n = (sin 0.3, cos 0.3): nobody says so, the positions and gaps do."""
    sheet = Sheet(2)
    coordinates = sheet.coordinates("flight.x", "flight.y")
    x, y = sheet.point("ball.origin", *sheet.q)
    from mbd.equations.equations import Contact

    gap = float(np.sin(0.3)) * x + float(np.cos(0.3)) * y - 0.2
    sheet.outputs["floor.gap"] = gap
    contact = Contact("floor", "unilateral", gap, sheet.rate(gap))
    equations = sheet.equations(
        "ball", coordinates, 0.5 * sheet.v[0] ** 2, sheet.tape.zero, contacts=[contact], figure=[("ball", ["origin"])]
    )
    t = np.linspace(0.0, 1.0, 101)
    q, v = np.column_stack([t, 1.0 - t**2]), np.column_stack([1.0 + 0.0 * t, -2.0 * t])
    (ground,) = scene(Trajectory(record(equations, t, q, v, np.tile([0.0, -2.0], (101, 1)))), 60).grounds
    np.testing.assert_allclose(ground.normal, [np.sin(0.3), np.cos(0.3), 0.0], atol=1e-9)
    assert ground.offset == pytest.approx(0.2)


@pytest.mark.slow
def test_the_page_plays_in_a_browser_without_a_network(tmp_path):
    """Needs playwright and Chromium; the clock runs, keys and sliders move it, nothing is logged as an error."""
    with opened(walker().page(tmp_path / "page.html"), "#t=0.75") as tab:
        assert tab.inner_text("#clock") == "0.750 s" and tab.inner_text("#name") == "walker"
        tab.keyboard.press("ArrowDown")
        tab.wait_for_timeout(100)
        assert tab.inner_text("#clock") == "1.000 s" and "left foot" in tab.inner_text("#events .now")
        tab.keyboard.press("Space")
        tab.wait_for_timeout(600)
        assert float(tab.inner_text("#clock").removesuffix(" s")) > 1.2
        tab.keyboard.press("Space")
        pixels = "c.getContext('2d').getImageData(0, 0, c.width, c.height).data"
        ink = f"c => {pixels}.filter((x, i) => i % 4 == 3 && x).length"
        assert tab.eval_on_selector("#scene", ink) > 2000
        tab.mouse.move(300, 300)
        tab.mouse.wheel(0, -300)
        assert "0.00 s of" not in tab.get_attribute("#time", "aria-valuetext")
        tab.click("#events li:last-child button")
        tab.select_option("#chart", "1")
        tab.wait_for_timeout(100)
        assert tab.inner_text("#clock") == "2.000 s" and "trunk.x" in tab.inner_text("#legend")


def test_a_sampled_law_with_a_delay_is_no_mode_of_the_page(tmp_path):
    model = mbd.Model("sampled")
    rod = mbd.Link("rod", mass=1.0, length=1.0, center=0.5, inertia=0.1)
    model.connect(pin := mbd.Revolute("pin", model.ground.origin, rod.start))
    model.apply(mbd.Motor("drive", pin, torque=0.0))
    model.apply(mbd.SampledLaw("law", 0.02, {"drive.torque": lambda q: -q}, arguments=("pin.angle",), delay=0.005))
    run = mbd.simulate(model, mbd.assemble(model, position={"pin.angle": 0.5}), dt=1e-2, until=0.1)
    assert run.facts.modes == ()
    assert run.page(tmp_path / "page.html").is_file()
