"""From markers and force plates to the damper of a prosthetic knee, and on to another ankle.

The trial is synthetic, so that its truth is known: the walker of prosthetic_leg.py with a viscous knee, filmed at 200
Hz with errors of 0.5 mm and a hidden marker, over a force plate under each foot. The files are read, the motion is
found from the markers, the moments from motion and plates, and from the swings of the prosthetic leg the damper of its
knee: 0.79 N m s/rad of 0.8. With it the walker is simulated again, with two ankles.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import mbd

PLACES = {
    "thigh": {"FRONT": (0.06, -0.15), "SIDE": (-0.05, -0.32)},
    "shank": {"TOP": (0.05, -0.05), "LOW": (-0.04, -0.3)},
}


def leg(model, hip, side, other, masses, ahead, knee_loss=None, **ankle):
    """A leg as in prosthetic_leg.py, with markers."""
    thigh = mbd.Link(f"{side} thigh", length=0.43, **mbd.rod(masses[0], length=0.43).link)
    shank = mbd.Link(f"{side} shank", length=0.34, **mbd.rod(masses[1], length=0.34).link)
    foot = mbd.RigidBody(f"{side} foot", mass=masses[2], inertia=(0.003, 0.003, 0.003), center=(0.0, -0.05, 0.0))
    for body, part in (thigh, "thigh"), (shank, "shank"):
        for name, place in PLACES[part].items():
            mbd.Marker(f"{side[0].upper()}{part[:2].upper()} {name}", body, place)
    mbd.Marker(f"{side[0].upper()}HEEL", foot, (-0.06, -0.07))
    mbd.Marker(f"{side[0].upper()}TOE", foot, (0.15, -0.06))
    knee = mbd.Revolute(f"{side} knee", thigh.end, shank.start, loss=knee_loss)
    model.connect(mbd.Revolute(f"{side} hip", hip.origin, thigh.start), knee)
    model.connect((mbd.Revolute if ankle else mbd.Weld)(f"{side} ankle", shank.end, foot.origin, **ankle))
    ball = foot.point(ahead, -0.08, name="ball")
    model.constrain(
        mbd.Unilateral(f"{side} ball", mbd.touchdown(ball), release=mbd.When(f"{other} ball")),
        mbd.Penalty(f"{side} knee stop", mbd.flexion(knee), stiffness=1300.0, restitution=0.4),
    )
    return ball


def walker(damper, stiffness):
    """The walker with these dampers of the prosthetic knee and this ankle, and the points of its feet."""
    model = mbd.Model("amputee", gravity=mbd.on_slope(0.025))
    hip = mbd.PointMass("hip", mass=47.0)
    mbd.Marker("HIP", hip.origin)
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    ankle = mbd.Tabulated(rate=[-30.0, -6.0, -2.0, 2.0, 6.0, 30.0], torque=[-24.0, -8.0, -4.0, 4.0, 8.0, 24.0])
    left = leg(model, hip, "left", "right", (7.0, 3.5, 1.0), 0.01)
    right = leg(
        model, hip, "right", "left", (7.0, 2.1, 0.7), 0.0025, mbd.Viscous(damper), stiffness=stiffness, loss=ankle
    )
    angles = {"left hip.angle": 0.204, "right hip.angle": -0.263, "left knee.angle": 0.0, "right knee.angle": 0.0}
    rates = {"left hip.angle": -0.9, "right hip.angle": -0.31, "left knee.angle": 0.0, "right knee.angle": 0.0}
    return model, mbd.assemble(model, angles, rates, closed="left ball", open="right ball"), (left, right)


# the trial, which a laboratory has
model, start, feet = walker(damper=0.8, stiffness=160.0)
integrator, dt, until = mbd.HHT(alpha=0.05), 1e-3, 4.0
film = mbd.simulate(model, start, integrator, dt=dt, until=until)
time, rng = np.arange(0.0, until, 0.005), np.random.default_rng(1)
seen = film.at(time)
names = [f"{side}{part}" for side in "LR" for part in ("TH FRONT", "TH SIDE", "SH TOP", "SH LOW", "HEEL", "TOE")]
markers = {name: seen[name] + 0.0005 * rng.standard_normal((len(time), 3)) for name in ["HIP", *names]}
markers["RSH TOP"][100:106] = np.nan
plates = []
for number, foot in enumerate(feet, 1):
    force = np.column_stack([seen[f"{foot.body.name[:-5]} ball.{part}"] for part in ("friction", "force")])
    force = np.column_stack([force, 0.0 * time])
    plates.append(
        mbd.PlateRecord.at(f"plate {number}", time, force, seen[foot.full_name] * [1.0, 0.0, 1.0], height=0.0)
    )
with TemporaryDirectory() as folder:
    mbd.Recording(time, markers).save(Path(folder) / "walk.trc")
    mbd.Recording(time, plates=tuple(plates)).save(Path(folder) / "walk.mot")
    trial, loads = mbd.read(Path(folder) / "walk.trc"), mbd.read(Path(folder) / "walk.mot")

# motion, plates, moments
motion = mbd.inverse_kinematics(model, trial, cutoff=8.0)
plates = mbd.assign_plates(motion, loads, feet)
moments = mbd.inverse_dynamics(model.without("right knee loss"), motion, plates=plates)

# the damper of the prosthetic knee, from its swings: moment = −c · rate
swing = moments["right knee.angle"] < -0.05
rate, moment = moments["right knee.rate"][swing], moments["right knee.moment"][swing]
damper = -float(rate @ moment / (rate @ rate))

# another ankle, with the damper that was found
runs = []
for stiffness in 160.0, 240.0:
    model, start, _ = walker(damper, stiffness)
    runs.append(mbd.simulate(model, start, integrator, dt=dt, until=until))

if __name__ == "__main__":
    print(motion, moments, f"damper {damper:.3f} N m s/rad", sep="\n")
    print(mbd.gait_report(*runs, names=("soft", "stiff")))
