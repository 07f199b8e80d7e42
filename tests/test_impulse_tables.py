"""Impulses in tables: each of a run once, those of contacts that were closed before an impact among them."""

import numpy as np
import pytest

import mbd


def hammered(friction: float | None = None, speed: float = 0.0) -> mbd.Trajectory:
    """A hammer falls on a block that stands on the floor."""
    model = mbd.Model("anvil")
    block, hammer = mbd.PointMass("block", mass=5.0), mbd.PointMass("hammer", mass=2.0)
    model.connect(
        mbd.Translation("slide", model.ground.origin, block.origin),
        mbd.Translation("fall", model.ground.origin, hammer.origin),
    )
    model.constrain(
        mbd.Unilateral("floor", mbd.touchdown(block.origin), friction=friction),
        mbd.Unilateral("strike", mbd.measure(lambda a, b: a - b - 0.5, "fall.y", "slide.y")),
    )
    start = mbd.assemble(
        model, closed=["floor"], position={"fall.y": 1.5}, velocity={"slide.x.rate": speed}
    )  # fmt: skip
    return mbd.simulate(model, start, dt=1e-2, until=0.6, backend="python")


@pytest.mark.parametrize(("friction", "speed"), [(None, 0.0), (0.3, 6.0)])
def test_impulses_change_the_momentum_by_what_the_table_says(friction, speed):
    run = hammered(friction, speed)
    strike = next(event for event in run.events if event.name == "strike" and event.kind == "closed")
    table = run.impulses.to_dataframe()
    table = table[np.isclose(table["time"], strike.time)]
    before, after = run.at(strike.time, side="before"), run.at(strike.time, side="after")
    gained = {name: after[name] - before[name] for name in ("fall.y.rate", "slide.y.rate", "slide.x.rate")}
    taken = {(row["name"], row["part"]): row["impulse"] for _, row in table.iterrows()}
    np.testing.assert_allclose(taken["strike", "normal"], 2.0 * gained["fall.y.rate"], rtol=1e-9)
    np.testing.assert_allclose(
        taken["floor", "normal"] - taken["strike", "normal"], 5.0 * gained["slide.y.rate"], atol=1e-9
    )
    assert taken["floor", "normal"] > 1.0 and set(table["unit"]) == {"N s"} and set(table["event"]) == {"strike"}
    if friction:
        np.testing.assert_allclose(taken["floor", "friction"], 5.0 * gained["slide.x.rate"], rtol=1e-9)


def test_files_and_pages_of_text_have_the_same_impulses(tmp_path):
    run = hammered()
    again = mbd.load(run.save(tmp_path / "run"))
    assert again.impulses == run.impulses
    assert "of 'floor', normal, in the impact of 'strike'" in repr(run.impulses)
    assert "floor: " in run.events._repr_html_() and "taken by" in run.impulses._repr_html_()


def test_a_run_without_impacts_has_an_empty_table():
    model = mbd.Model("free")
    mass = mbd.PointMass("mass", mass=1.0)
    model.connect(mbd.Translation("place", model.ground.origin, mass.origin))
    run = mbd.simulate(model, mbd.assemble(model), dt=1e-2, until=0.05, backend="python")
    assert repr(run.impulses) == "no impulses"
    assert list(run.impulses.to_dataframe().columns) == ["time", "event", "name", "part", "impulse", "unit"]
