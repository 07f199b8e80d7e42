"""Small mistakes are reported by name, where they were made."""

import numpy as np
import pytest

import mbd
from mbd.equations import derive


def pendulum(**options):
    model = mbd.Model("pendulum", **options)
    rod = mbd.Link("rod", 1.0, 1.0, 0.5, 1.0 / 12.0)
    model.connect(mbd.Revolute("hinge", model.ground.origin, rod.start))
    return model


MODEL = pendulum()
START = mbd.assemble(MODEL, position={"hinge.angle": 0.3})
RUN = mbd.simulate(MODEL, START, dt=1e-2, until=0.1, backend="python")


@pytest.mark.parametrize("write", [RUN.save, RUN.page, lambda path: RUN.plot("hinge.angle", path=path)])
@pytest.mark.parametrize("path", ["", ".", "/", 3])
def test_what_names_no_file_is_refused_before_anything_is_written(tmp_path, monkeypatch, write, path):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(mbd.TrajectoryError, match="a file to write to is expected"):
        write(path)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize("kind", ["joints", "forces", "constraints", "controllers"])
@pytest.mark.parametrize(
    "strange", ["x", None, 3.0, mbd.PointMass("ball", 1.0)], ids=["text", "none", "number", "body"]
)
def test_what_is_no_word_of_its_list_is_named_with_the_list(kind, strange):
    model = pendulum()
    getattr(model, kind).append(strange)
    said = f"model.{kind} of 'pendulum' holds "
    assert model.check()[0].startswith(said)
    for use in (mbd.assemble, mbd.Model.describe, mbd.mobility):
        with pytest.raises(mbd.ModelError, match=said):
            use(model)


@pytest.mark.parametrize("error", [ValueError("no such start"), KeyError("rod.mass"), ZeroDivisionError()])
def test_a_start_that_raises_is_told_with_its_function_and_the_values_of_the_sweep(error):
    def at_angle(parameters):
        if parameters["rod.mass"] > 1.5:
            raise error
        return START

    table = mbd.sweep(MODEL, {"rod.mass": [1.0, 2.0]}, at_angle, dt=1e-2, until=0.05, backend="python")
    assert table.success == (True, False)
    assert "at_angle at rod.mass = 2 raised " + type(error).__name__ in table.messages[1]


def test_arrays_of_a_run_cannot_be_written_to_or_are_copies():
    before = RUN.time.copy(), RUN["hinge.angle"].copy(), RUN.energy.kinetic.copy(), RUN.energy.total.copy()
    for hand in (
        lambda: RUN.time, lambda: RUN.t, lambda: RUN["hinge.angle"], lambda: RUN.record.q, lambda: RUN.energy.kinetic,
        lambda: RUN.energy.total, lambda: RUN.at([0.05])["hinge.angle"],
    ):  # fmt: skip
        kept = hand().copy()
        try:
            hand()[0] += 1.0
        except ValueError as told:
            assert "read-only" in str(told)  # noqa: PT017
        np.testing.assert_array_equal(hand(), kept)
    after = RUN.time, RUN["hinge.angle"], RUN.energy.kinetic, RUN.energy.total
    for one, other in zip(before, after, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("guard", [lambda angle: 1.0, lambda angle: 0.0 * angle - 2.0, lambda angle: angle - angle])
def test_an_event_whose_guard_never_changes_is_refused_by_name(guard):
    model = pendulum()
    model.constrain(mbd.Event("fall", mbd.measure(guard, "hinge.angle")))
    with pytest.raises(mbd.ModelError, match="guard of Event 'fall' never changes"):
        mbd.assemble(model)


@pytest.mark.parametrize("on", ["hinge.angle", "hinge.rate", "t", "rod.end.x"])
def test_an_event_whose_guard_changes_is_not(on):
    model = pendulum()
    model.constrain(mbd.Event("fall", mbd.measure(lambda value: value - 0.1, on)))
    assert [guard.name for guard in derive(model).guards] == ["fall"]


@pytest.mark.parametrize("name", ["hinge.rate", "hinge.angle", "hinge.angle.rate", "rod.end.x"])
def test_a_reset_of_what_a_cut_joint_or_a_place_has_is_refused_at_the_start(name):
    model = pendulum(cut="all")
    model.constrain(mbd.Event("kick", mbd.measure(lambda t: t - 0.05, "t"), reset={name: 0.0}))
    start = mbd.assemble(model)
    with pytest.raises(mbd.UnknownNameError, match=f"reset of 'kick': '{name}' is a result.*'rod floating.angle'"):
        mbd.simulate(model, start, dt=1e-2, until=0.01, backend="python")


def test_an_eighth_order_step_into_a_steep_wall_is_shortened():
    rng = np.random.default_rng(0)
    for _ in range(6):
        steep, speed, far, tol = 10.0 ** rng.uniform((1.5, 0.0, -1.0, -8.0), (5.0, 3.0, 1.0, -3.0))
        model = mbd.Model("wall", gravity=(0.0, 0.0, 0.0))
        ball = mbd.PointMass("ball", 1.0)
        model.connect(mbd.Prismatic("slide", model.ground.origin, ball.origin, axis=(1.0, 0.0, 0.0)))
        wall = mbd.Potential("wall", lambda x, k=steep: mbd.exp(k * x) / k, "slide.displacement")
        model.apply(wall)
        start = mbd.assemble(model, {"slide.displacement": -far}, {"slide.displacement": speed})
        run = mbd.simulate(model, start, mbd.RungeKutta853(), tol=tol, until=3.0 * far / speed)
        assert run["slide.rate"][-1] == pytest.approx(-speed, rel=0.02)
