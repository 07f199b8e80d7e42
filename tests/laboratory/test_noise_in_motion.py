"""Noise in measured angles: what inverse dynamics tells of the scatter of its moments."""

import warnings

import numpy as np
import pytest

import mbd


def arm():
    model = mbd.Model("arm")
    upper = mbd.Link("upper", mass=2.0, length=0.3, center=0.13, inertia=0.016)
    lower = mbd.Link("lower", mass=1.2, length=0.25, center=0.11, inertia=0.007)
    model.connect(
        mbd.Revolute("shoulder", model.ground.origin, upper.start), mbd.Revolute("elbow", upper.end, lower.start)
    )
    return model


def motion(count, step, rng):
    time = step * np.arange(count)
    first, second = (0.5 * np.sin(rng.uniform(3.0, 12.0) * time + rng.uniform(0.0, 6.0)) for _ in range(2))
    return {"time": time, "shoulder.angle": first, "elbow.angle": 0.8 + second}


@pytest.mark.parametrize("seed", range(6))
def test_the_scatter_told_is_that_of_the_moments(seed):
    """Within a third, for motions of 60 to 400 frames; the same motion without noise gives no warning."""
    rng = np.random.default_rng(seed)
    true = motion(int(rng.integers(60, 400)), rng.uniform(0.005, 0.012), rng)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        clean = mbd.inverse_dynamics(arm(), true)
    size = 10.0 ** rng.uniform(-3.3, -2.3)
    noisy = {name: x + size * rng.normal(size=x.shape) * (name != "time") for name, x in true.items()}
    with pytest.warns(mbd.MbdWarning, match="scatters by about"):
        found = mbd.inverse_dynamics(arm(), noisy)
    note = found.notes[-1]
    name = note.split("'")[1]
    actual = np.std((found[name] - clean[name])[3:-3])
    assert float(note.split("about ")[1].split()[0]) == pytest.approx(actual, rel=0.35)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        smooth = {k: x if k == "time" else mbd.Samples(noisy["time"], x, kind="smooth") for k, x in noisy.items()}
        cured = mbd.inverse_dynamics(arm(), smooth)
    middle = slice(len(true["time"]) // 5, -len(true["time"]) // 5)
    assert np.std((cured[name] - clean[name])[middle]) < 0.2 * actual


def test_a_recording_gives_its_channels_that_are_coordinates(tmp_path):
    rng = np.random.default_rng(2)
    own = motion(80, 0.01, rng)
    time = own.pop("time")
    recording = mbd.Recording(time, {"RHEE": np.zeros((80, 3))}, {**own, "emg": rng.normal(size=80)})
    found = mbd.inverse_dynamics(arm(), recording)
    assert found.notes == ("channels that are no coordinates are not used: 'emg'",)
    direct = mbd.inverse_dynamics(arm(), {"time": time, **own})
    assert np.array_equal(found["elbow.moment"], direct["elbow.moment"])
    wrong = mbd.Recording(time, {}, {"shoulder.angle": own["shoulder.angle"], "Elbow": own["elbow.angle"]})
    with pytest.raises(mbd.ModelError, match=r"'elbow.angle' of 'arm' is missing.*the recording has 'Elbow'"):
        mbd.inverse_dynamics(arm(), wrong)
