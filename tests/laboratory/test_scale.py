"""A person scaled to a patient: lengths from markers, masses by the table, everything else in proportion."""

import logging

import numpy as np
import pytest

import mbd


def test_segments_have_the_lengths_that_markers_show(caplog):
    person = mbd.human(75.0, 1.80)
    rng = np.random.default_rng(0)
    hip = np.array([0.0, 0.9, -0.1]) + 0.001 * rng.normal(size=(40, 3))
    static = mbd.Recording(
        np.arange(40) / 100.0, {"LHIP": hip, "LKNE": hip - [0.0, 0.41, 0.0], "LANK": hip - [0.0, 0.80, 0.0]}
    )
    with caplog.at_level(logging.INFO, logger="mbd"):
        patient = mbd.scale(
            person, {"left thigh": ("LHIP", "LKNE"), "left shank": 0.39, "pelvis": 0.19}, static, mass=62.0
        )
    bodies = patient.bodies
    assert bodies["left thigh"].length == pytest.approx(0.41) and bodies["right thigh"].length == pytest.approx(0.41)
    assert bodies["right shank"].length == pytest.approx(0.39)
    assert patient.mass == pytest.approx(62.0)
    hips = [frame.offset[2] for frame in bodies["pelvis"].points.values() if frame.name.endswith("hip")]
    assert abs(hips[0] - hips[1]) == pytest.approx(0.19)
    said = " ".join(record.message for record in caplog.records)
    assert "'right thigh' as 'left thigh'" in said and "'head' by the mean" in said


@pytest.mark.parametrize("scatter", [0.005, 0.05])
def test_markers_that_do_not_keep_their_distance_are_doubted(scatter, recwarn):
    hip = np.tile([0.0, 0.9, -0.1], (40, 1))
    knee = hip - np.outer(0.41 + scatter * (-1.0) ** np.arange(40), [0.0, 1.0, 0.0])
    static = mbd.Recording(np.arange(40) / 100.0, {"LHIP": hip, "LKNE": knee})
    mbd.scale(mbd.human(75.0, 1.80), {"left thigh": ("LHIP", "LKNE")}, static)
    told = [
        str(each.message) for each in recwarn if "varies by 50 mm; do both lie on the left thigh" in str(each.message)
    ]
    assert len(told) == (scatter > 0.02) and not any("varies by 5 mm" in str(each.message) for each in recwarn)


def test_masses_are_shared_as_before_and_inertia_follows():
    person = mbd.human(75.0, 1.80)
    patient = mbd.scale(person, {"left shank": 1.1 * person.bodies["left shank"].length}, mass=90.0)
    for name, body in person.bodies.items():
        old, new = body.fields(), patient.bodies[name].fields()
        assert new["mass"] == pytest.approx(1.2 * old["mass"])
        for axis in ("xx", "yy", "zz"):
            assert new[f"inertia.{axis}"] == pytest.approx(1.2 * 1.21 * old[f"inertia.{axis}"])


def test_a_prosthesis_stays_as_it_is():
    foot = mbd.RigidBody("right foot", mass=0.8, inertia=(0.001, 0.002, 0.002))
    person = mbd.human(75.0, 1.80).replaced("right foot", foot)
    patient = mbd.scale(person, {"left thigh": 0.45}, mass=70.0)
    assert patient.bodies["right foot"] is foot and patient.mass == pytest.approx(70.0)


@pytest.mark.parametrize(
    ("lengths", "more", "words"),
    [
        ({"left tigh": 0.4}, {}, "did you mean 'left thigh'"),
        ({"left thigh": -0.4}, {}, "must be positive"),
        ({"left thigh": ("A", "B")}, {}, "give the recording"),
        ({"left thigh": ("A", "C")}, {"recording": mbd.Recording([0.0], {"A": [(0, 0, 0)], "B": [(0, 1, 0)]})}, "'C'"),
        ({}, {}, "lengths must map"),
        ({"left thigh": 0.4}, {"mass": -1.0}, "must be positive"),
    ],
)
def test_what_does_not_fit_is_named(lengths, more, words):
    with pytest.raises(mbd.ModelError, match=words):
        mbd.scale(mbd.human(75.0, 1.80), lengths, **more)


def test_lengths_in_millimeters_and_a_mass_in_grams_are_doubted():
    with pytest.warns(mbd.MbdWarning, match="are the lengths in meters"):
        mbd.scale(mbd.human(75.0, 1.80), {"left thigh": 430.0})
    with pytest.warns(mbd.MbdWarning, match="907 times the mass of before; is the mass in kilograms"):
        mbd.scale(mbd.human(75.0, 1.80), {"left thigh": 0.43}, mass=68e3)


@pytest.mark.parametrize("bend", [0.0, 0.5])
def test_a_bent_knee_in_the_static_trial_is_doubted(bend, recwarn):
    hip = np.tile([0.0, 0.9, -0.1], (10, 1))
    knee = hip + 0.41 * np.array([np.sin(bend), -np.cos(bend), 0.0])
    static = mbd.Recording(np.arange(10) / 100.0, {"LHIP": hip, "LKNE": knee, "LANK": knee - [0.0, 0.39, 0.0]})
    lengths = {"left thigh": ("LHIP", "LKNE"), "left shank": ("LKNE", "LANK")}
    mbd.scale(mbd.human(75.0, 1.80), lengths, static)
    said = [str(each.message) for each in recwarn if issubclass(each.category, mbd.MbdWarning)]
    assert any("left knee is bent by 29°" in text for text in said) == (bend > 0.0)
