"""Inverse kinematics: the nearest postures that least_squares finds, with gaps, loops, stops and standard errors."""

import time
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import least_squares

import mbd
from mbd.compile.mechanisms import mechanism_of
from mbd.laboratory.marker_program import marker_program

PLACES = [(0.06, -0.05, 0.08), (-0.07, -0.2, -0.05), (0.03, -0.3, 0.1)]


def person(limbs=("left arm", "right arm")):
    """A person with three markers on each segment."""
    body = mbd.human(75.0, 1.8).without(*limbs)
    names = []
    for name, segment in body.bodies.items():
        for k, place in enumerate(PLACES):
            names.append(f"{name} {k}")
            mbd.Marker(names[-1], segment, place)
    model = mbd.Model("person")
    model.connect(*body.joints)
    return body, model, names


def walk(body, model, names, count, rng, noise=0.0):
    """A motion of all coordinates with its markers: (recording, true q)."""
    mechanism = mechanism_of(model)
    begin = mbd.assemble(model, position=body.standing(0.3))
    times = np.arange(count) / 100.0
    n_v = mechanism.equations.n_v
    x = rng.normal(size=n_v) * 0.2 * np.sin(5.0 * times[:, None] + rng.normal(size=n_v) * 3.0)
    q = mechanism.equations.configuration.compose(np.array(begin.q), x)
    y, _ = marker_program(mechanism, names, [], [], []).at_all(times, q, mechanism.parameters())
    y = y + noise * rng.normal(size=y.shape)
    markers = {name: y[:, 3 * k : 3 * k + 3].copy() for k, name in enumerate(names)}
    return mbd.Recording(times, markers), q


def test_markers_without_noise_give_the_motion_back():
    body, model, names = person()
    recording, q = walk(body, model, names, 30, np.random.default_rng(0))
    found = mbd.inverse_kinematics(model, recording)
    apart = mechanism_of(model).equations.configuration.difference(q, found.run.record.q)
    assert np.abs(apart).max() < 1e-9
    assert found.rms < 1e-10 and not found.notes


def test_postures_are_those_of_least_squares():
    body, model, names = person()
    rng = np.random.default_rng(1)
    recording, q = walk(body, model, names, 6, rng, noise=0.005)
    recording.markers["left foot 1"][2] = np.nan
    weights = {name: float(rng.uniform(0.5, 2.0)) for name in names}
    found = mbd.inverse_kinematics(model, recording, {name: name for name in names}, weights=weights)
    mechanism = mechanism_of(model)
    program, whole = marker_program(mechanism, names, [], [], []), mechanism.equations.configuration
    w = np.repeat([weights[name] for name in names], 3)
    for k in (0, 2, 5):
        seen = np.column_stack([recording.markers[name][k] for name in names]).T.ravel()
        own = np.where(np.isnan(seen), 0.0, w)

        def problem(x, base=q[k], seen=seen, own=own):
            y, J = program.at_all(np.zeros(1), whole.compose(base, x)[None], mechanism.parameters())
            return own * (y[0] - np.nan_to_num(seen)), own[:, None] * J[0]

        zero = np.zeros(mechanism.layout.n_v)
        best = least_squares(lambda x: problem(x)[0], zero, lambda x: problem(x)[1], xtol=1e-15, ftol=1e-15)
        place = whole.compose(q[k], best.x)
        for _ in range(6):  # steps so small that sums of squares do not tell them apart
            r, J = problem(zero, place)
            place = whole.compose(place, np.linalg.lstsq(J, -r, rcond=None)[0])
        assert np.abs(whole.difference(place, found.run.record.q[k])).max() < 1e-10
        y, J = program.at_all(np.zeros(1), found.run.record.q[k][None], mechanism.parameters())
        slope = (own[:, None] * J[0]).T @ (own * (y[0] - np.nan_to_num(seen)))
        bend = (own[:, None] * J[0]).T @ (own[:, None] * J[0])
        assert np.abs(np.linalg.solve(bend, slope)).max() < 1e-9  # the minimum itself
    assert np.isnan(found.residual["left foot 1"][2]) and np.isfinite(found.residual["left foot 1"][3])


def test_standard_errors_predict_the_scatter_of_angles():
    """200 trials with noise of 5 mm: the mean square of (angle − true)/error is 1 within its own scatter."""
    model = mbd.Model("leg")
    thigh = mbd.Link("thigh", mass=8.0, length=0.4, center=0.2, inertia=0.1)
    shank = mbd.Link("shank", mass=3.0, length=0.4, center=0.2, inertia=0.04)
    names = []
    for body in (thigh, shank):
        for k, (x, y) in enumerate([(0.05, -0.05), (-0.06, -0.2), (0.04, -0.35)]):
            names.append(f"{body.name} {k}")
            mbd.Marker(names[-1], body, (x, y))
    model.connect(mbd.Planar("hip", model.ground.origin, thigh.start), mbd.Revolute("knee", thigh.end, shank.start))
    rng = np.random.default_rng(4)
    q = np.column_stack([rng.normal(size=(200, 2)) * 0.1, rng.normal(size=(200, 2)) * 0.2])
    program = marker_program(mechanism_of(model), names, [], [], [])
    y, _ = program.at_all(np.zeros(200), q, mechanism_of(model).parameters())
    y = y + 0.005 * rng.normal(size=y.shape)
    recording = mbd.Recording(np.arange(200.0), {name: y[:, 3 * k : 3 * k + 3] for k, name in enumerate(names)})
    found = mbd.inverse_kinematics(model, recording)
    for name, k in (("hip.x", 0), ("hip.angle", 2), ("knee.angle", 3)):
        off = (found[name] - q[:, k]) / found.standard_error[name]
        assert abs(np.mean(off**2) - 1.0) < 4.0 * np.sqrt(2.0 / 200.0)


def four_bar():
    model = mbd.Model("four-bar")
    crank = mbd.Link("crank", mass=1.0, length=0.1, center=0.03, inertia=0.0005)
    coupler = mbd.Link("coupler", mass=0.8, length=0.35, center=0.2, inertia=0.007)
    rocker = mbd.Link("rocker", mass=0.7, length=0.3, center=0.1, inertia=0.004)
    mbd.Marker("A", coupler, (0.1, -0.1))
    mbd.Marker("B", coupler, (-0.05, -0.3))
    model.connect(
        mbd.Revolute("drive", model.ground.origin, crank.start),
        mbd.Revolute("crank pin", crank.end, coupler.start),
        mbd.Revolute("coupler pin", coupler.end, rocker.end),
        mbd.Revolute("rocker pin", model.ground.point(0.4, 0.0, 0.0), rocker.start),
    )
    return model


def test_loops_hold_while_markers_are_followed():
    model = four_bar()
    start = mbd.assemble(model, velocity={"drive.rate": 3.0})
    run = mbd.simulate(model, start, dt=1e-2, until=0.4)
    rng = np.random.default_rng(0)
    noisy = {name: run[name] + 0.003 * rng.normal(size=(len(run), 3)) for name in ("A", "B")}
    found = mbd.inverse_kinematics(model, mbd.Recording(run.time, noisy), start=start)
    assert found["coupler.end"] == pytest.approx(found["rocker.end"], abs=1e-9)
    assert np.abs(found["drive.angle"] - run["drive.angle"]).max() < 0.1
    exact = mbd.inverse_kinematics(
        model, mbd.Recording(run.time, {name: run[name] for name in ("A", "B")}), start=start
    )
    assert exact["drive.angle"] == pytest.approx(run["drive.angle"], abs=1e-9)


def test_stops_of_joints_are_not_passed():
    model = mbd.Model("knee")
    shank = mbd.Link("shank", mass=3.0, length=0.4, center=0.2, inertia=0.04)
    mbd.Marker("ankle", shank, (0.0, -0.4))
    knee = mbd.Revolute("knee", model.ground.origin, shank.start)
    model.connect(knee)
    model.constrain(mbd.Unilateral("stop", mbd.flexion(knee)))  # never in front
    angles = np.linspace(-0.5, 0.4, 10)
    track = np.column_stack([0.4 * np.sin(angles), -0.4 * np.cos(angles), 0.0 * angles])
    found = mbd.inverse_kinematics(model, mbd.Recording(np.arange(10.0), {"ankle": track}))
    assert found["knee.angle"] == pytest.approx(np.minimum(angles, 0.0), abs=1e-9)
    assert any("stops reached: 'stop'" in note for note in found.notes)


def test_what_no_marker_determines_is_named_and_stays():
    body, model, names = person()
    recording, _ = walk(body, model, names, 5, np.random.default_rng(2))
    kept = {name: track for name, track in recording.markers.items() if not name.startswith("left foot")}
    found = mbd.inverse_kinematics(model, mbd.Recording(recording.time, kept))
    assert any("do not determine 'left ankle.first', 'left ankle.second'" in note for note in found.notes)
    assert np.isnan(found.standard_error["left ankle.first"]).all()
    assert np.ptp(found["left ankle.first"]) < 1e-6
    assert np.isfinite(found.standard_error["left knee.angle"]).all()


def test_measured_coordinates_are_followed_with_their_weight():
    model = mbd.Model("knee")
    shank = mbd.Link("shank", mass=3.0, length=0.4, center=0.2, inertia=0.04)
    mbd.Marker("ankle", shank, (0.0, -0.4))
    model.connect(mbd.Revolute("knee", model.ground.origin, shank.start))
    recording = mbd.Recording([0.0, 1.0], {"ankle": [(0.0, -0.4, 0.0)] * 2}, {"goniometer": [0.02, -0.02]})
    found = mbd.inverse_kinematics(
        model, recording, coordinates={"knee.angle": "goniometer"}, weights={"knee.angle": 0.4}
    )
    # 0.4² φ² against 0.4² (φ − φ_m)²: sin φ cos 0 … is stationary where sin φ + φ − φ_m = 0
    assert np.sin(found["knee.angle"]) + found["knee.angle"] == pytest.approx([0.02, -0.02], abs=1e-9)


def test_moments_follow_from_filtered_markers():
    body, model, names = person()
    recording, _ = walk(body, model, names, 100, np.random.default_rng(3), noise=0.002)
    found = mbd.inverse_kinematics(model, recording, cutoff=6.0)
    moments = mbd.inverse_dynamics(model, found)
    assert moments["left knee.moment"].shape == (100,)
    exact, _ = walk(body, model, names, 100, np.random.default_rng(3))
    true = mbd.inverse_dynamics(model, mbd.inverse_kinematics(model, exact))
    off = moments["left knee.moment"] - true["left knee.moment"]
    assert np.sqrt(np.mean(off[20:-20] ** 2)) < 0.1 * np.ptp(true["left knee.moment"])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"markers": {"HEEL": "shank.end"}}, "the recording has 'ankle'"),
        ({"markers": {"ankle": "shank.ende"}}, "did you mean 'shank.end'"),
        ({"markers": {"ankle": 3}}, "must be a point of the model"),
        ({"weights": {"toe": 1.0}}, "no marker named 'toe'"),
        ({"weights": {"ankle": -1.0}}, "must not be negative"),
        ({"coordinates": {"knee.angel": [0.0, 0.0]}}, "did you mean 'knee.angle'"),
        ({"coordinates": {"knee.angle": [0.0]}}, "a value for each of the 2 frames"),
        ({"recording": {"ankle": [0.0]}}, "what mbd.read gives"),
        (
            {"recording": mbd.Recording([0.0, 1.0], {"ankle": [(0.0, -0.4, 0.0), (np.nan,) * 3]})},
            "no marker is seen at t = 1 s",
        ),
        ({"recording": mbd.Recording([0.0], {"toe": [(0.0, 0.0, 0.0)]})}, "no marker of the recording has the name"),
        ({"start": 3}, "a state of 'knee'"),
    ],
)
def test_what_does_not_fit_is_named(change, words):
    model = mbd.Model("knee")
    shank = mbd.Link("shank", mass=3.0, length=0.4, center=0.2, inertia=0.04)
    mbd.Marker("ankle", shank, (0.0, -0.4))
    model.connect(mbd.Revolute("knee", model.ground.origin, shank.start))
    given = {"recording": mbd.Recording([0.0, 1.0], {"ankle": [(0.0, -0.4, 0.0)] * 2}), **change}
    with pytest.raises(mbd.ModelError, match=words):
        mbd.inverse_kinematics(model, **given)


def test_markers_that_are_missing_on_either_side_are_told_and_other_units_refused():
    model = mbd.Model("knee")
    shank = mbd.Link("shank", mass=3.0, length=0.4, center=0.2, inertia=0.04)
    for name, place in (("ANK", (0.0, -0.4)), ("TIB", (0.05, -0.2)), ("FIB", (-0.05, -0.3))):
        mbd.Marker(name, shank, place)
    model.connect(mbd.Revolute("knee", model.ground.origin, shank.start))
    seen = {"ANK": np.array([[0.0, -0.4, 0.0]] * 2), "TIB": np.array([[0.05, -0.2, 0.0]] * 2), "TOE": np.zeros((2, 3))}
    found = mbd.inverse_kinematics(model, mbd.Recording([0.0, 1.0], seen))
    assert "1 markers are no points of the model: 'TOE'" in found.notes
    assert "the recording lacks markers of the model: 'FIB'" in found.notes
    with pytest.raises(mbd.ModelError, match=r"1e\+03 times as far from each other on a body .* in meters"):
        mbd.inverse_kinematics(model, mbd.Recording([0.0, 1.0], {name: 1e3 * place for name, place in seen.items()}))


def test_markers_behind_a_subject_and_with_dots_are_those_of_the_model():
    """As Nexus and OpenSim name them: 'Anna:ANK', 'R.Heel'."""
    model = mbd.Model("knee")
    shank = mbd.Link("shank", mass=3.0, length=0.4, center=0.2, inertia=0.04)
    for name, place in (("ANK", (0.0, -0.4)), ("R_Tibia", (0.05, -0.2))):
        mbd.Marker(name, shank, place)
    model.connect(mbd.Revolute("knee", model.ground.origin, shank.start))
    seen = {"Anna:ANK": np.array([[0.0, -0.4, 0.0]] * 2), "Anna:R.Tibia": np.array([[0.05, -0.2, 0.0]] * 2)}
    found = mbd.inverse_kinematics(model, mbd.Recording([0.0, 1.0], seen))
    assert "markers are those behind the subject 'Anna'" in found.notes
    assert found["knee.angle"] == pytest.approx([0.0, 0.0], abs=1e-9)
    both = seen | {"Bert:ANK": seen["Anna:ANK"]}
    with pytest.raises(mbd.ModelError, match="two markers of the recording are 'ANK' of the model"):
        mbd.inverse_kinematics(model, mbd.Recording([0.0, 1.0], both))


@pytest.mark.parametrize("all_of_them", [True, False])
def test_other_units_are_told_where_no_posture_is_near(all_of_them):
    """Markers at joints alone, of which no two lie on one body."""
    model = mbd.Model("chain")
    links = [mbd.Link(f"link {k}", mass=1.0, length=0.4, center=0.2, inertia=0.02) for k in range(3)]
    hip = mbd.Planar("hip", model.ground.origin, links[0].start)
    model.connect(hip, *(mbd.Revolute(f"joint {k}", a.end, b.start) for k, (a, b) in enumerate(pairwise(links))))
    markers = {"HIP": links[0].start, **{f"M{k}": link.end for k, link in enumerate(links)}}
    seen = {name: np.array([[0.1 * k, 0.9 - 0.39 * k, 0.0]] * 3) for k, name in enumerate(markers)}
    for name in markers if all_of_them else ("M2",):
        seen[name] = 1e3 * seen[name]
    words = "Markers lie .* are they in meters" if all_of_them else "Marker 'M2' lies .* is it in meters"
    with pytest.raises(mbd.ModelError, match=words):
        mbd.inverse_kinematics(model, mbd.Recording(np.arange(3.0), seen), markers=markers)


@pytest.mark.slow
def test_a_frame_of_a_person_with_forty_markers_takes_at_most_a_millisecond():
    body, model, names = person(limbs=())
    recording, _ = walk(body, model, names, 1000, np.random.default_rng(5), noise=0.005)
    mbd.inverse_kinematics(model, recording)
    started = time.process_time()
    mbd.inverse_kinematics(model, recording)
    assert time.process_time() - started < 1.0


@pytest.mark.parametrize(
    "wrong",
    [
        lambda elbow, wrist: (wrist, elbow),
        lambda *both: [p / 1e3 for p in both],
        lambda *both: [p[:, [0, 2, 1]] for p in both],
    ],
)
def test_markers_that_stay_far_from_the_model_are_told(wrong):
    """Exchanged, in other units, with z up: one marker to a body, so that no distance on a body tells."""
    arm, elbow = mbd.Model("arm"), mbd.Link("upper", mass=2.0, length=0.3, center=0.13, inertia=0.016)
    lower = mbd.Link("lower", mass=1.2, length=0.25, center=0.11, inertia=0.007)
    arm.connect(mbd.Revolute("shoulder", arm.ground.origin, elbow.start), mbd.Revolute("elbow", elbow.end, lower.start))
    mbd.Marker("ELB", elbow, (0.0, -0.3))
    mbd.Marker("WRI", lower, (0.0, -0.25))
    time = np.linspace(0.0, 1.0, 21)
    first, second = 0.4 * np.sin(5.0 * time), 0.4 * np.sin(5.0 * time) + 0.9
    places = [0.3 * np.column_stack([np.sin(first), -np.cos(first), 0.0 * time])]
    places.append(places[0] + 0.25 * np.column_stack([np.sin(second), -np.cos(second), 0.0 * time]))
    assert not mbd.inverse_kinematics(arm, mbd.Recording(time, dict(zip(("ELB", "WRI"), places, strict=True)))).notes
    recording = mbd.Recording(time, dict(zip(("ELB", "WRI"), wrong(*places), strict=True)))
    with pytest.warns(mbd.MbdWarning, match=r"m from its place on the model \(rms; . of 2 markers") as told:
        found = mbd.inverse_kinematics(arm, recording)
    assert found.notes == (str(told[0].message),)


def test_times_in_milliseconds_are_doubted():
    arm, rod = mbd.Model("arm"), mbd.Link("upper", mass=2.0, length=0.3, center=0.13, inertia=0.016)
    arm.connect(mbd.Revolute("shoulder", arm.ground.origin, rod.start))
    time = np.arange(20) * 10.0
    with pytest.warns(mbd.MbdWarning, match="frames are 10 s apart; times are in seconds, and 10 ms is 0.01 s"):
        mbd.inverse_dynamics(arm, {"time": time, "shoulder.angle": 0.3 * np.sin(0.005 * time)})
