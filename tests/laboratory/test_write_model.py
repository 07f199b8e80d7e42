"""Models written as URDF and .osim are read back with the same equations of motion, marks and muscles."""

import copy

import numpy as np
import pytest

import mbd
from tests.forces.test_wrapping import SURFACES, elbow
from tests.helpers import one_body

INERTIA = (0.05, 0.04, 0.03, 0.002, -0.003, 0.001)


def machine(ball, seed=0):
    """Joints of every kind that the formats have, between tilted frames beside the origins of their bodies."""
    rng = np.random.default_rng(seed)
    model = mbd.Model("machine", gravity=(0.3, -9.81, 0.2))

    def body(name):
        return mbd.RigidBody(name, float(rng.uniform(1.0, 3.0)), INERTIA, tuple(rng.normal(scale=0.1, size=3)))

    def place(owner):
        axis = rng.normal(size=3)
        return owner.point(*map(float, rng.normal(scale=0.2, size=3))).turned(float(rng.uniform(-3, 3)), tuple(axis))

    trunk, arm, hand, slide, plate, wheel, tool = map(body, ("trunk", "arm", "hand", "slide", "plate", "wheel", "tool"))
    loss = mbd.Viscous(0.3) + mbd.Coulomb(0.2)
    knee = mbd.Revolute("knee", place(arm), place(hand), axis=(1.0, 2.0, -2.0), loss=loss)
    kind, name = (mbd.Spherical, "ball") if ball else (mbd.Cylindrical, "sleeve")
    model.connect(
        mbd.Free("root", place(model.ground), place(trunk)),
        mbd.Universal("hip", place(trunk), place(arm), axis=(0, 1, 0), second_axis=(0, 0, 1)),
        knee,
        mbd.Prismatic("rail", place(slide), place(trunk), axis=(0.0, 1.0, 1.0)),  # from the outer body to the inner one
        mbd.Planar("table", place(slide), place(plate)),
        mbd.Weld("flange", place(plate), place(tool)),
        kind(name, place(tool), place(wheel)),
    )  # fmt: skip
    model.constrain(
        mbd.Unilateral("lower", mbd.extension(knee, offset=-0.4)),
        mbd.Unilateral("upper", mbd.flexion(knee, offset=-1.2)),
    )
    mbd.Marker("TIP", hand, (0.1, -0.2, 0.05))
    points = (trunk.point(0.1, 0.0), arm.point(0.0, 0.1, 0.02), hand.point(0.05, 0.0))
    model.apply(
        mbd.Muscle("biceps", points, 600.0, 0.1, 0.2, 0.1, tendon="rigid", activation_time=0.0, deactivation_time=0.0)
    )
    model.apply(mbd.Spring("spring", trunk.origin, hand.origin, 10.0, 0.3))
    return model


def frames(model, rename, seed=1):
    """A random motion in the coordinates of a model, and the same by the names of another."""
    rng = np.random.default_rng(seed)
    state = mbd.assemble(model)
    count = 6
    given = {}
    for name in state.names:
        if ".orientation." in name:
            continue
        given[name] = rng.normal(scale=0.3, size=count)
    for name in {n.rpartition(".")[0] for n in state.names if ".orientation." in n}:
        q = rng.normal(size=(count, 4)) * 0.1 + [1.0, 0.0, 0.0, 0.0]
        given[name] = q / np.linalg.norm(q, axis=1, keepdims=True)
    rates = {name.removesuffix(".rate"): rng.normal(size=count) for name in state.velocity_names}
    time = np.arange(count) * 1.0
    return {"time": time} | {rename(name): value for name, value in given.items()}, rates


def balance(model, motion):
    found = mbd.inverse_dynamics(model, motion)
    whole = found.effort + found._residual
    return dict(zip(found.run.record.equations.velocity_names, whole.T, strict=True))


def urdf_name(name):
    """Of a coordinate as the file has it."""
    owner, _, label = name.rpartition(".")
    if owner in ("hip", "table", "sleeve"):
        unit = "displacement" if label in ("x", "y", "displacement") else "angle"
        return f"{owner} {label}.{unit}"
    return name


def osim_name(name):
    owner, _, label = name.rpartition(".")
    if owner in ("hip", "table", "sleeve"):
        unit = "displacement" if label in ("x", "y", "displacement") else "angle"
        return f"{owner}_{label}.{unit}"
    return name


@pytest.mark.parametrize(("suffix", "rename"), [(".urdf", urdf_name), (".osim", osim_name)])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_model_comes_back_with_the_same_equations_of_motion(suffix, rename, seed, tmp_path):
    model = machine(ball=suffix == ".osim", seed=seed)
    path = tmp_path / f"machine{suffix}"
    report = mbd.write_model(model, path)
    read = mbd.read_model(path, **({"stops": False} if suffix == ".osim" else {}))
    bare = model.without("spring", "biceps", *(["knee loss"] if suffix == ".osim" else []))
    motion, _ = frames(bare, lambda name: name)
    again = {rename(name) if name != "time" else name: value for name, value in motion.items()}
    gravity = {} if suffix == ".osim" else {"gravity": model.gravity}
    other = read.model if not gravity else _with_gravity(read.model, model.gravity)
    first, second = balance(bare, motion), balance(other, again)
    size = max(np.abs(values).max() for values in first.values())
    assert len(first) == len(second)
    for name, values in first.items():
        stem = rename(name.removesuffix(".rate")) + ".rate" if name.endswith(".rate") else name
        np.testing.assert_allclose(second[stem], values, atol=1e-10 * size, err_msg=name)
    assert "Spring 'spring'" in str(report)
    if suffix == ".osim":
        place = mbd.assemble(read.model)["TIP"]
        np.testing.assert_allclose(place, mbd.assemble(model)["TIP"], atol=1e-13)
        np.testing.assert_allclose(read.muscles["biceps"].fiber_length, 0.1)
        assert read.muscles["biceps"].tendon == "rigid"
    else:
        stops = {word.name: word for word in read.model.constraints}
        assert stops["knee lower stop"].measure.offset == -0.4 and stops["knee upper stop"].measure.offset == -1.2


def _with_gravity(model, gravity):
    """The format has no gravity."""
    other = copy.copy(model)
    other.gravity = gravity
    return other


def test_what_a_format_lacks_is_named(tmp_path):
    with pytest.raises(mbd.ModelError, match="URDF has no Spherical"):
        mbd.write_model(machine(ball=True), tmp_path / "m.urdf")
    with pytest.raises(mbd.ModelError, match=r"\.urdf or \.osim"):
        mbd.write_model(machine(ball=True), tmp_path / "m.xml")
    body, model = mbd.RigidBody("nut", 1.0, INERTIA), mbd.Model("screw")
    model.connect(mbd.Screw("screw", model.ground.origin, body.origin, 0.1))
    for suffix in (".urdf", ".osim"):
        with pytest.raises(mbd.ModelError, match="no Screw"):
            mbd.write_model(model, tmp_path / f"m{suffix}")
    alike = mbd.Model("alike")
    a, b = mbd.RigidBody("left foot", 1.0, INERTIA), mbd.RigidBody("left_foot", 1.0, INERTIA)
    alike.connect(mbd.Revolute("one", alike.ground.origin, a.origin), mbd.Revolute("two", a.origin, b.origin))
    with pytest.raises(mbd.ModelError, match="alike without blanks"):
        mbd.write_model(alike, tmp_path / "m.osim")


@pytest.mark.parametrize("suffix", [".urdf", ".osim"])
def test_stops_are_written_or_listed(suffix, tmp_path):
    """Of a slider along one axis of a `Translation`, and of a joint that closes a loop, which no file has."""
    model = mbd.Model("loop")
    a, b, c = (mbd.Link(name, mass=1.0, length=1.0, center=0.5, inertia=0.1) for name in "abc")
    sled = mbd.RigidBody("sled", 1.0, (0.1, 0.1, 0.1, 0.0, 0.0, 0.0))
    slider = mbd.Translation("slider", model.ground.origin, sled.origin, axes="x")
    closing = mbd.Revolute("closing", c.end, model.ground.point(1.0, 0.0))
    model.connect(
        mbd.Revolute("first", model.ground.origin, a.start), mbd.Revolute("second", a.end, b.start),
        mbd.Revolute("third", b.end, c.start), closing, slider,
    )  # fmt: skip
    model.constrain(
        mbd.Unilateral("near", mbd.extension(slider, offset=-0.5)),
        mbd.Unilateral("far", mbd.flexion(slider, offset=-0.7)),
        *(mbd.Unilateral(f"{j.name} stop", mbd.flexion(j, offset=-3.0)) for j in model.joints if j is not slider),
    )
    report = mbd.write_model(model, tmp_path / f"loop{suffix}")
    assert "0.7" in (tmp_path / f"loop{suffix}").read_text()
    left = "; ".join(report.left_out)
    assert "'near'" not in left and "'far'" not in left
    (cut,) = [line.split("'")[1] for line in report.left_out if "closes a loop" in line]
    assert f"'{cut} stop'" in left


@pytest.mark.parametrize("surface", SURFACES)
def test_surfaces_of_paths_come_back(surface, tmp_path):
    model = elbow(SURFACES[surface])
    report = mbd.write_model(model, tmp_path / "arm.osim")
    assert "1 muscles" in str(report) and not report.left_out
    again = mbd.read_model(tmp_path / "arm.osim")
    again.model.apply(*again.muscles.values())
    for turn, angle in (0.3, 1.1), (-0.2, 1.6), (0.1, -0.9):
        lengths = [
            mbd.assemble(each, {"turn.angle": turn, "elbow.angle": angle}, backend="python")["triceps.length"]
            for each in (model, again.model)
        ]
        assert lengths[1] == pytest.approx(lengths[0], abs=1e-14)


def test_the_activation_of_a_muscle_comes_back(tmp_path):
    model, arm = one_body(mbd.RigidBody("arm", 1.0, (0.01, 0.01, 0.01, 0.0, 0.0, 0.0)), mbd.Revolute, "elbow")
    points = (model.ground.point(0.0, 0.3), arm.point(0.02, -0.05))
    model.apply(mbd.Muscle("biceps", points, 600.0, 0.1, 0.2, excitation=0.4, damping=0.0))
    mbd.write_model(model, tmp_path / "arm.osim")
    (muscle,) = mbd.read_model(tmp_path / "arm.osim").muscles.values()
    assert (muscle.excitation, muscle.damping) == (0.4, 0.0)


@pytest.mark.parametrize("names", [("base", "base"), ("pelvis", "base"), ("base", "thigh")])
def test_a_robot_that_was_read_is_written_without_a_link_or_joint_more(names, tmp_path):
    """The root link is held to the ground by a joint of mbd's own, which must be no second 'base' in the file."""
    link, joint = names
    inertial = (
        '<inertial><origin xyz="0.1 0 -0.2" rpy="0.3 0 0.2"/><mass value="3"/>'
        '<inertia ixx="0.3" iyy="0.2" izz="0.2"/></inertial>'
    )
    text = (
        f'<robot name="r"><link name="{link}">{inertial}</link><link name="shank">{inertial}</link>'
        f'<joint name="{joint}" type="revolute"><parent link="{link}"/><child link="shank"/>'
        '<origin xyz="0.1 0.2 -0.4" rpy="0.2 0.1 0.3"/><axis xyz="0 1 0"/><limit lower="-1" upper="2"/></joint></robot>'
    )
    (tmp_path / "one.urdf").write_text(text, encoding="utf-8")
    first = mbd.read_model(tmp_path / "one.urdf")
    assert "as the root link" in str(mbd.write_model(first.model, tmp_path / "two.urdf"))
    second = mbd.read_model(tmp_path / "two.urdf")
    assert list(second.bodies) == [link, "shank"] and list(second.joints) == [joint]
    assert list(second.model.joints) != [] and len(second.model.joints) == 2
    motion = {"time": np.arange(6.0), f"{joint}.angle": np.sin(np.arange(6.0))}
    moments = [mbd.inverse_dynamics(each.model, motion)[f"{joint}.moment"] for each in (first, second)]
    np.testing.assert_allclose(moments[1], moments[0], atol=1e-12)


def test_a_body_welded_to_the_ground_askew_is_the_root_link_in_axes_of_the_ground(tmp_path):
    model = mbd.Model("askew")
    socket, shank = (
        mbd.RigidBody("socket", 1.0, INERTIA, (0.1, 0.0, 0.2)),
        mbd.RigidBody("shank", 2.0, INERTIA, (0.0, -0.2, 0.1)),
    )
    wall = model.ground.point(0.3, 1.0, -0.2).turned(0.7, (1.0, 2.0, 0.5))
    model.connect(mbd.Weld("wall", wall, socket.point(0.0, 0.1, 0.3).turned(-0.4, (0.0, 1.0, 1.0))))
    model.connect(mbd.Revolute("knee", socket.point(0.1, -0.3, 0.0), shank.origin, axis=(1.0, 0.0, 1.0)))
    mbd.write_model(model, tmp_path / "askew.urdf")
    read = mbd.read_model(tmp_path / "askew.urdf").model
    motion = {"time": np.arange(6.0), "knee.angle": np.sin(np.arange(6.0))}
    found, again = (mbd.inverse_dynamics(each, motion) for each in (model, read))
    np.testing.assert_allclose(again["knee.moment"], found["knee.moment"], atol=1e-12)
    np.testing.assert_allclose(again["shank.center"], found["shank.center"], atol=1e-12)


@pytest.mark.parametrize("suffix", [".urdf", ".osim"])
def test_a_planar_model_is_written_with_inertias_that_others_accept(suffix, tmp_path):
    """Links of the plane have a moment about z alone, which no body in space has."""
    model, _ = one_body(mbd.Link("arm", mass=1.0, length=0.3, center=0.15, inertia=0.01), mbd.Revolute, "elbow")
    report = mbd.write_model(model, tmp_path / f"arm{suffix}")
    assert "moments of 'arm' about x and y" in "; ".join(report.approximated)
    read = mbd.read_model(tmp_path / f"arm{suffix}").model
    motion = {"time": np.linspace(0.0, 1.0, 9), "elbow.angle": np.linspace(0.0, 1.0, 9) ** 3}
    found = mbd.inverse_dynamics(_with_gravity(read, model.gravity), motion)["elbow.moment"]
    np.testing.assert_allclose(found, mbd.inverse_dynamics(model, motion)["elbow.moment"], rtol=1e-12, atol=1e-12)
