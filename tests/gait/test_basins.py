"""Basins: the case k4, and that what becomes of a start depends on nothing but the start."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import mbd
from mbd.gait.basin.basin import BLOCK_SIZE
from tests.cases.walkers import compass, standing
from tests.gait.basins import LETTERS, classes, grid, start_of, walker
from tests.gait.walkers import slope_of
from tests.problems import case


@cache
def study(part: int = 10, **more) -> mbd.Basin:
    """Each part-th cell of the case along both axes."""
    theta, s = grid()
    model, gait = walker()
    axes = {"theta": theta[::part], "s": s[::part]}
    return mbd.basin(model, gait, axes, start=start_of, steps=30, dt=0.2, **more)


def agrees(found: mbd.Basin, part: int) -> None:
    """Every cell that the case decides is decided so."""
    wanted = classes()[::part, ::part]
    letters = np.vectorize(lambda word: LETTERS.get(word, "O"))(found.outcome)
    decided = wanted != "x"
    assert np.array_equal(letters[decided], wanted[decided])


def test_the_basin_of_the_simplest_walker_is_that_of_the_case():
    found = study()
    agrees(found, 10)
    ball = found.balls[0][0]
    assert ball is not None
    assert ball.radius >= 1e-3
    assert ball.contraction < 0.98
    assert (found.attractor == np.where(found.outcome == "walks", 0, -1)).all()


@pytest.mark.slow
def test_the_whole_grid_of_the_case():
    found = study(1)
    agrees(found, 1)
    counted = classes() != "x"
    sizes = [int(np.sum(found.outcome[counted] == word)) for word in LETTERS]
    assert [*sizes, 0] == list(case("k4-simplest-walker-basin").quantities[
        "cells: walks 20 steps and ends within 1e-2 of the fixed point (W), falls forward (F), falls backward (B), "
        "other (O); excluded cells not counted"
    ].value)  # fmt: skip


def same(one: mbd.Basin, other: mbd.Basin) -> bool:
    """Whether everything that was decided is the same, to the bit."""
    names = ("kind", "attractor", "steps", "time")
    return all(np.array_equal(getattr(one, name), getattr(other, name)) for name in names)


def test_threads_and_the_order_of_starts_change_nothing(monkeypatch):
    found = study()
    assert same(study(10, workers=1), found)
    assert same(study(10, workers=3), found)
    theta, s = grid()
    model, gait = walker()
    monkeypatch.setattr("mbd.gait.basin.basin.BLOCK_SIZE", 100)
    turned = mbd.basin(model, gait, {"s": s[::-10], "theta": theta[::-10]}, start=start_of, steps=30, dt=0.2)
    for name in ("kind", "attractor", "steps", "time"):
        ours = getattr(turned, name).T[::-1, ::-1]
        rows = np.isin(turned.axes["theta"][::-1], found.axes["theta"])
        columns = np.isin(turned.axes["s"][::-1], found.axes["s"])
        theirs = getattr(found, name)[np.isin(found.axes["theta"], turned.axes["theta"])]
        assert np.array_equal(ours[rows][:, columns], theirs[:, np.isin(found.axes["s"], turned.axes["s"])])


def test_a_study_that_was_killed_goes_on_where_it_was(tmp_path, monkeypatch):
    monkeypatch.setattr("mbd.gait.basin.basin.BLOCK_SIZE", 100)
    path, found = tmp_path / "basin.jsonl", study()
    assert BLOCK_SIZE > 100
    assert same(study(10, file=path), found)
    lines = path.read_bytes().splitlines(keepends=True)
    assert len(lines) == 5
    path.write_bytes(b"".join(lines[:3]) + lines[3][:50])  # in the midst of a line
    made = []
    monkeypatch.setattr("mbd.gait.basin.basin.Store.keep", _counted(made))
    study.cache_clear()
    assert same(study(10, file=path), found)
    assert made == [200, 300]
    with pytest.raises(mbd.ModelError, match="another basin, with other .*steps"):
        mbd.basin(*walker(), {"theta": [0.2], "s": [0.0]}, start=start_of, steps=3, dt=0.2, file=path)
    path.write_text(json.dumps({"format": "something"}) + "\n")
    with pytest.raises(mbd.ModelError, match="no file of a basin"):
        study(10, file=path, workers=2)


def test_a_file_is_of_one_start_and_one_function_of_parameters(tmp_path):
    """Functions that agree at the gait are others all the same, and so is a start that names other coordinates."""

    def steeper(by):
        return {"slope": lambda s: {"gamma": 0.009 + by * (s - 0.009)}}

    def turned(axes):
        found = start_of(axes)
        return {"phi.rate": found["theta.rate"], "theta.rate": found["phi.rate"], "theta": found["theta"],
                "phi": found["phi"]}  # fmt: skip

    (model, known), path = walker(), tmp_path / "basin.jsonl"
    gaits = [
        mbd.limit_cycle(model, known.state, section="heel strike", dt=0.1, longest=60.0, parameters={"slope": 0.009},
                        functions=steeper(by)) for by in (1.0, 1.5)
    ]  # fmt: skip
    how = {"axes": {"theta": [0.2], "s": [0.0], "slope": [0.0092]}, "steps": 2, "file": path}

    def slanting(axes, start=start_of):
        return {**start(axes), "slope": axes["slope"]}

    mbd.basin(model, gaits[0], start=slanting, **how)
    before = path.read_bytes()
    mbd.basin(model, gaits[0], start=slanting, **how)
    assert path.read_bytes() == before
    for gait, start in ((gaits[1], slanting), (gaits[0], lambda axes: slanting(axes, turned))):
        with pytest.raises(mbd.ModelError, match="another basin, with other .*functions"):
            mbd.basin(model, gait, start=start, **how)


def test_an_interrupted_study_keeps_what_is_decided_in_its_file_too(monkeypatch, tmp_path):
    """Ctrl-C in the third return of all starts: those that the first two decided keep their outcomes."""
    from mbd.gait.basin.walks import Walks

    whole, caught, calls = study(10), Walks._caught, []

    def interrupted(self, *given):
        calls.append(1)
        if len(calls) == 4:
            raise KeyboardInterrupt
        return caught(self, *given)

    monkeypatch.setattr(Walks, "_caught", interrupted)
    study.cache_clear()
    found = study(10, file=tmp_path / "basin.jsonl")
    study.cache_clear()
    done = found.outcome != "not decided"
    assert not found.complete and 0 < np.count_nonzero(done) < done.size
    assert np.array_equal(found.outcome[done], whole.outcome[done]) and found.steps.max() == 3
    decide, sizes = Walks.decide, []
    monkeypatch.setattr(
        Walks, "decide", lambda self, lines, *rest: sizes.append(len(lines)) or decide(self, lines, *rest)
    )
    again = study(10, file=tmp_path / "basin.jsonl")
    assert sizes == [np.count_nonzero(~done)] and again.complete and same(again, whole)
    assert same(study(10, file=tmp_path / "basin.jsonl"), whole) and len(sizes) == 1


def _counted(made):
    from mbd.gait.basin.basin import Store

    keep = Store.keep

    def counting(self, first, *rest):
        made.append(first)
        keep(self, first, *rest)

    return counting


@cache
def links() -> tuple[mbd.Model, mbd.LimitCycle]:
    """The compass gait of links."""
    reference = case("f2-compass-gait-3deg")
    sizes = reference.definition
    model = compass(sizes)
    start = standing(model, [0.2187, -0.3234, -1.0918, -0.3772], sizes["slope"])
    gait = mbd.limit_cycle(
        model, start, section="right foot", mirror=("left", "right"), parameters={"slope": sizes["slope"]},
        functions=slope_of(sizes["g"]),
    )  # fmt: skip
    return model, gait


def test_starts_of_links_are_moved_onto_the_section_and_fall_as_runs_do():
    model, gait = links()
    axes = {"left hip.rate": np.linspace(-2.2, -0.2, 5), "right hip.rate": np.linspace(-2.0, 1.0, 3)}
    found = mbd.basin(model, gait, axes, dt=0.02, steps=12)
    for index in np.ndindex(*found.shape):
        state = found.start(index)
        assert state["left hip.rate"] == axes["left hip.rate"][index[0]]
        arrival, outcome = None, "walks"
        map_ = replace(gait.map, dt=0.02)
        for _ in range(12):
            arrival = map_(replace(state, parameters={}))
            if not arrival.outcome.good:
                outcome = str(map_.explained(state, arrival.outcome))
                break
            state = arrival.state
        word = found.outcome[index]
        assert word in ("walks", "falls forward", "falls backward", "scuffs", "numerical error")
        assert outcome.startswith(word), (index, word, outcome)


def test_parameters_may_be_axes():
    model, gait = links()
    found = mbd.basin(model, gait, {"slope": [0.045, 0.0523, 0.3]}, dt=0.02, steps=40)
    assert list(found.outcome[:2]) == ["walks", "walks"]
    assert found.outcome[2].startswith("falls")
    assert len(found.balls) == 3
    assert found.balls[2] == [None]


def test_axes_that_a_start_alone_knows_have_no_unit():
    def tilted(axes):
        return start_of({"theta": np.radians(axes["angle"]), "s": axes["s"]})

    found = mbd.basin(*walker(), {"angle": [11.0], "s": [0.0]}, start=tilted, steps=1, dt=0.2)
    assert found.units == {} and found.to_xarray()["angle"].attrs["units"] == ""


def test_tables_and_pictures_show_what_was_found(tmp_path):
    found = study()
    assert sum(found.counts.values()) == len(found) == 400
    data = found.to_xarray()
    assert data.sizes == {"theta": 20, "s": 20}
    assert data["time"].attrs["units"] == "s"
    assert data["theta"].attrs["units"] == "rad"
    assert len(found.to_dataframe()) == 400
    assert "walks" in repr(found)
    assert "<table" in found._repr_html_()
    found.plot(tmp_path / "basin.png")
    assert (tmp_path / "basin.png").stat().st_size > 1000
    state = found.start((10, 10))
    assert state["phi"] == 2.0 * state["theta"]


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"axes": {}}, "axes must map"), ({"axes": {"thta": [0.2]}}, "theta"),
        ({"axes": {"theta": []}}, "at least one"),
        ({"axes": {"theta": [float("nan")]}}, "not finite"), ({"axes": {"theta": ["a"]}}, "list of numbers"),
        ({"axes": {("theta", "theta.rate"): [0.2, 0.3]}}, "tuples of 2"), ({"axes": 3}, "axes must map"),
        ({"axes": {"theta": [0.1], ("theta", "phi"): [(0.1, 0.2)]}}, "given twice"), ({"steps": 0}, "steps"),
        ({"start": 3}, "start must be"), ({"start": lambda axes: {"theta": [0.1, 0.2, 0.3]}}, "3 numbers"),
        ({"start": lambda axes: {"tht": axes["theta"]}}, "tht"), ({"dt": -1.0}, "dt"), ({"longest": "a"}, "longest"),
        ({"gait": None}, "mbd.limit_cycle"), ({"gait": []}, "mbd.limit_cycle"), ({"workers": -1}, "workers"),
        ({"parameters": {"gama": 0.1}}, "gamma"), ({"parameters": {"gamma": "a"}}, "finite"),
        ({"model": mbd.Model("other")}, "another model"), ({"progress": 3}, "progress"), ({"file": 3}, "file"),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_said_before_the_first_run(wrong, words):
    model, gait = walker()
    right = {"model": model, "gait": gait, "axes": {"theta": [0.2, 0.3]}, **wrong}
    with pytest.raises(mbd.MbdError, match=words):
        mbd.basin(**right)


def test_gaits_that_attract_nothing_are_refused():
    model, gait = walker()
    with pytest.raises(mbd.ModelError, match="attracts nothing"):
        mbd.basin(model, mbd.limit_cycle(
            model, replace(gait.state, q=np.array([0.1939, 0.3878]), v=np.array([-0.2031, -0.015])),
            section="heel strike", dt=0.1, longest=60.0,
        ), {"theta": [0.2]})  # fmt: skip


def test_a_start_that_no_state_of_the_section_has_is_told():
    model, gait = walker()
    found = mbd.basin(model, gait, {"theta": [0.2, 0.3], "phi": [0.4]}, dt=0.2, steps=2)
    assert found.outcome[1, 0] == "not on the section"
    with pytest.raises(mbd.ModelError, match="not on the section"):
        found.start((1, 0))
    with pytest.raises(mbd.ModelError, match="places"):
        found.start((5, 0))
