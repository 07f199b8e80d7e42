"""Plots: what they show, without a window."""

import re
import struct

import numpy as np
import pytest
from matplotlib import pyplot
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import to_hex, to_rgb
from matplotlib.text import Text

import mbd
from mbd.errors import TrajectoryError, UnknownNameError
from mbd.view.curves import curves, extremes
from mbd.view.plots import contacts, phase_portrait, stretches
from mbd.view.report import write
from mbd.view.style import DARK, INK, PALE, PAPER, color
from tests.view.handmade_runs import ball, oscillator, walker


@pytest.fixture(autouse=True)
def _no_window_stays_open():
    yield
    pyplot.close("all")


def is_picture(path) -> bool:
    head = path.read_bytes()[:24]
    width, height = struct.unpack(">II", head[16:24])
    return head.startswith(b"\x89PNG") and width > 300 and height > 100


def test_histories_have_one_panel_per_unit_and_the_contacts_below():
    figure = walker().plot("left hip.angle", "right hip.angle", "left foot.force")
    angles, forces, bars = figure.axes
    assert angles.get_ylabel() == "angle [°]" and forces.get_ylabel() == "force [N]"
    assert [text.get_text() for text in angles.get_legend().get_texts()] == ["left hip.angle", "right hip.angle"]
    assert [label.get_text() for label in bars.get_yticklabels()] == ["left foot", "right foot"]
    assert bars.get_xlabel() == "time [s]"


def test_long_steps_are_drawn_smooth_and_rows_are_met():
    run = ball()
    times, values = curves(run, ["flight.y"])
    assert len(times) > 500 and np.all(np.diff(times) >= 0.0)
    rows = np.searchsorted(times, run.time)
    assert np.array_equal(times[rows], run.time) and np.allclose(values["flight.y"][rows], run["flight.y"], atol=1e-15)
    assert np.count_nonzero(np.diff(times) == 0.0) == np.count_nonzero(np.diff(run.time) == 0.0)


def test_histories_mark_the_events():
    run = ball()
    figure = run.plot("flight.y")
    (marks,) = (each for each in figure.axes[0].collections if isinstance(each, LineCollection))
    assert [line[0][0] for line in marks.get_segments()] == [e.time for e in run.events if e.kind == "closed"]


def test_histories_without_names_show_the_coordinates_and_a_vector_its_components():
    assert [line.get_label() for line in oscillator().plot().axes[0].lines] == ["slider.displacement"]
    labels = [line.get_label() for line in ball().plot("ball.origin").axes[0].lines][:3]
    assert labels == ["ball.origin.x", "ball.origin.y", "ball.origin.z"]
    with pytest.raises(UnknownNameError, match="flight.y"):
        ball().plot("flight.why")


def test_the_energy_plot_stacks_what_is_left_and_what_is_lost():
    run = ball()
    figure = run.energy.plot()
    upper, lower = figure.axes
    labels = [text.get_text() for text in upper.get_legend().get_texts()]
    assert labels == ["kinetic", "potential (above its least)", "lost: floor impact", "start"]
    assert sum(not isinstance(each, LineCollection) for each in upper.collections) == 3
    assert lower.get_ylabel() == "numerical [J]"
    assert upper.get_ylabel() == "energy [J]"


def test_the_energy_plot_raises_its_ceiling_with_what_is_put_in():
    upper = oscillator().energy.plot().axes[0]
    ledger = oscillator().energy
    (ceiling,) = upper.lines
    np.testing.assert_allclose(
        ceiling.get_ydata(), ledger.total[0] - ledger.potential.min() + ledger["push"], atol=1e-12
    )
    assert ceiling.get_label() == "start + put in"


def test_the_phase_portrait_jumps_in_dots():
    axes = phase_portrait(ball(bounces=3), "flight.y").axes[0]
    (dotted,) = (line for line in axes.lines if line.get_linestyle() == ":")
    place, rate = (np.reshape(values, (-1, 3)) for values in (dotted.get_xdata(), dotted.get_ydata()))
    assert len(place) == 4 and np.isnan(place[:, 2]).all() and np.isnan(rate[:, 2]).all()
    assert np.all(np.abs(np.ptp(place[:, :2], axis=1)) < 1e-9) and np.all(np.ptp(rate[:, :2], axis=1) > 1e-9)
    assert axes.get_xlabel() == "length [m]" and axes.get_ylabel() == "rate [m/s]"


def test_pictures_are_written_where_asked_for(tmp_path):
    run = walker()
    run.plot(path=tmp_path / "new" / "a.png")
    run.energy.plot(path=tmp_path / "b.png")
    phase_portrait(run, path=tmp_path / "c.png")
    contacts(run, path=tmp_path / "d.png")
    assert all(is_picture(tmp_path / name) for name in ("new/a.png", "b.png", "c.png", "d.png"))
    assert not pyplot.get_fignums()


def test_stretches_are_the_times_of_closed_rows():
    assert stretches([0.0, 1.0, 2.0, 2.0, 3.0], [1, 1, 0, 1, 1]) == [(0.0, 1.0), (2.0, 3.0)]
    assert stretches([0.0, 1.0], [0, 0]) == []


def test_sides_have_their_colors():
    assert color("left knee lock") == color("left thigh") != color("right thigh") != color("hip")


def test_angles_are_drawn_in_degrees_and_results_stay_in_radians():
    run = walker()
    radians = run["left hip.angle"]
    for degrees, factor, label in ((True, 180.0 / np.pi, "angle [°]"), (False, 1.0, "angle [rad]")):
        axes = run.plot("left hip.angle", degrees=degrees).axes[0]
        time, values = (np.asarray(column) for column in axes.lines[0].get_data())
        assert axes.get_ylabel() == label
        assert np.array_equal(values[np.searchsorted(time, run.time)], factor * radians)
    assert run["left hip.angle"] is radians
    portrait = phase_portrait(run, "left hip.angle").axes[0]
    assert portrait.get_xlabel() == "angle [°]" and portrait.get_ylabel() == "rate [°/s]"
    start = next(line.get_data() for line in portrait.lines if line.get_marker() == "o")
    assert np.allclose(np.ravel(start), np.degrees([radians[0], run["left hip.angle.rate"][0]]), rtol=1e-12)


def test_times_of_contact_are_shaded_in_the_color_of_their_side():
    run = walker()
    axes = run.plot("left hip.angle", "left foot.force").axes[0]
    closed = run.record.closed[:, [contact.name for contact in run.facts.contacts].index("left foot")]
    (bands,) = (each for each in axes.collections if isinstance(each, PolyCollection))
    shades = [(path.vertices[:, 0].min(), path.vertices[:, 0].max()) for path in bands.get_paths()]
    assert np.allclose(shades, stretches(run.time, closed)) and len(shades)
    assert to_hex(bands.get_facecolor()[0]).upper() == color("left foot")
    both = [each for each in run.plot("left hip.angle").axes[0].collections if isinstance(each, PolyCollection)]
    assert {to_hex(each.get_facecolor()[0]).upper() for each in both} == {color("left foot"), color("right foot")}


def test_thinned_curves_keep_every_peak():
    rng = np.random.default_rng(7)
    time, values = np.linspace(0.0, 20.0, 30001), rng.normal(size=30001)
    time[9000:9010] = time[9000]  # rows of one instant
    values[::7] = np.nan  # such as the angle of a disk that lies flat
    shown = extremes(time, values)
    assert len(shown) < 5000 and shown[0] == 0 and shown[-1] == 30000 and np.all(np.diff(shown) > 0)
    parts = np.floor(time / 20.0 * 1000)
    for part in rng.integers(0, 1000, 20):
        whole, kept = values[parts == part], values[shown][parts[shown] == part]
        assert np.nanmin(whole) == np.nanmin(kept) and np.nanmax(whole) == np.nanmax(kept)
    np.testing.assert_array_equal(extremes(time[:50], values[:50]), np.arange(50))


def contrast(one, other) -> float:
    """Ratio of relative luminances (WCAG 2.2)."""

    def luminance(shade):
        parts = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in to_rgb(shade)]
        return float(np.dot((0.2126, 0.7152, 0.0722), parts))

    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("style", ["default", "dark_background"])
def test_plots_can_be_read_on_the_paper_of_the_present_style(style):
    with pyplot.style.context(style):
        for figure in (walker().plot("left hip.angle", "left foot.force"), ball().energy.plot()):
            figure.draw_without_rendering()
            paper = figure.get_facecolor()
            assert (contrast(paper, "white") < 1.1) is (style == "default")
            texts = [text for text in figure.findobj(Text) if text.get_text().strip() and text.get_visible()]
            lines = [line for axes in figure.axes for line in axes.lines if line.get_alpha() is None]
            assert len(texts) > 10 and lines
            assert min(contrast(text.get_color(), paper) for text in texts) > 4.5
            assert min(contrast(line.get_color(), paper) for line in lines) > 3.0


def test_a_drawing_in_vectors_has_ink_for_light_and_for_dark_pages(tmp_path):
    walker().plot("left hip.angle", "left foot.force", path=tmp_path / "plot.svg")
    picture = (tmp_path / "plot.svg").read_text(encoding="utf-8")
    rules = dict(re.findall(r'\[style\*="fill: (#\w+)"\]\{fill:(#\w+) !important\}', picture))
    assert "prefers-color-scheme: dark" in picture and rules
    inks = set(re.findall(r"(?:fill|stroke): (#\w+)", picture.partition("</style>")[2]))
    assert INK.lower() in inks and "#000000" not in inks
    on_dark = {rules.get(ink, ink) for ink in inks} - {PALE.lower(), DARK[PALE].lower()}
    assert min(contrast(ink, DARK[PAPER]) for ink in on_dark) > 3.0
    walker().plot("left hip.angle", "left foot.force", path=tmp_path / "again.svg")
    assert (tmp_path / "again.svg").read_text(encoding="utf-8") == picture


def test_a_file_among_the_names_of_a_plot_is_answered_with_its_argument():
    with pytest.raises(TrajectoryError, match=r"give a file as path, plot\(path='swing.png'\)"):
        walker().plot("swing.png")


def test_where_orientations_alone_move_no_phase_portrait_is_written(tmp_path):
    model = mbd.Model("ball joint")
    model.connect(mbd.Spherical("ball", model.ground.origin, mbd.RigidBody("body", 1.0, (1.0, 2.0, 2.5)).origin))
    run = mbd.simulate(model, mbd.assemble(model), dt=0.01, until=0.02)
    assert not (tmp_path / "phase.png").exists() and tmp_path / "phase.png" not in write(run, tmp_path, {})
