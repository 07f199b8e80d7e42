"""From markers and force plates to the damper of a prosthetic knee, and on to another ankle.

The trial is synthetic, so that its truth is known: a walker with a prosthetic leg and a viscous knee is filmed at 200
Hz with errors of 0.5 mm, over a force plate under each foot. The files are read, the motion is found from the markers,
the moments from motion and plates, and from the swings of the prosthetic leg the damper of its knee, 0.8 N m s/rad.
With it the walker is simulated again, with two ankles.
"""

from tempfile import mkdtemp

import mbd


def walker(damper, stiffness):
    """The walker of prosthetic_leg.py with this damper of the right knee and this ankle."""
    model = mbd.Model("amputee", gravity=mbd.on_slope(0.025))
    hip = mbd.PointMass("hip", mass=47.0)
    model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
    rubber = mbd.Tabulated(rate=[-30.0, -6.0, -2.0, 2.0, 6.0, 30.0], torque=[-24.0, -8.0, -4.0, 4.0, 8.0, 24.0])
    ankles = {"left": {}, "right": {"stiffness": stiffness, "loss": rubber}}
    for side, other, shin, sole, ahead in ("left", "right", 3.5, 1.0, 0.01), ("right", "left", 2.1, 0.7, 0.0025):
        thigh = mbd.Link(f"{side} thigh", length=0.43, **mbd.rod(7.0, length=0.43).link)
        shank = mbd.Link(f"{side} shank", length=0.34, **mbd.rod(shin, length=0.34).link)
        foot = mbd.RigidBody(f"{side} foot", mass=sole, inertia=(0.003, 0.003, 0.003), center=(0.0, -0.05, 0.0))
        knee = mbd.Revolute(f"{side} knee", thigh.end, shank.start, loss=mbd.Viscous(damper) if ankles[side] else None)
        model.connect(mbd.Revolute(f"{side} hip", hip.origin, thigh.start), knee)
        joint = mbd.Revolute if ankles[side] else mbd.Weld
        model.connect(joint(f"{side} ankle", shank.end, foot.origin, **ankles[side]))
        ball = mbd.touchdown(foot.point(ahead, -0.08, name="ball"))
        stop = mbd.Penalty(f"{side} knee stop", mbd.flexion(knee), stiffness=1300.0, restitution=0.4)
        model.constrain(mbd.Unilateral(f"{side} ball", ball, release=mbd.When(f"{other} ball")), stop)
    position = {"left hip.angle": 0.204, "right hip.angle": -0.263, "left knee.angle": 0.0, "right knee.angle": 0.0}
    velocity = {"left hip.angle": -0.9, "right hip.angle": -0.31, "left knee.angle": 0.0, "right knee.angle": 0.0}
    return model, mbd.assemble(model, position, velocity, closed="left ball", open="right ball")


# the trial, which a laboratory has
parts = "thigh.end", "shank.end", "foot.ball"
markers = ["hip.origin", *(f"{side} {part}" for side in ("left", "right") for part in parts)]
model, start = walker(damper=0.8, stiffness=160.0)
integrator, dt, until = mbd.HHT(alpha=0.05), 1e-3, 4.0
film = mbd.simulate(model, start, integrator, dt=dt, until=until)
folder = mkdtemp()
for ending in "trc", "mot":
    mbd.film(film, markers, rate=200.0, scatter=5e-4).save(f"{folder}/walk.{ending}")

# motion, plates, moments
trial, loads = mbd.read(f"{folder}/walk.trc"), mbd.read(f"{folder}/walk.mot")
motion = mbd.inverse_kinematics(model, trial, cutoff=8.0)
plates = mbd.assign_plates(motion, loads, [model.bodies["left foot"], model.bodies["right foot"]])
moments = mbd.inverse_dynamics(model.without("right knee loss"), motion, plates=plates)

# the damper of the prosthetic knee, from its swings: moment = −c · rate
swing = moments["right knee.angle"] < -0.05
rate, moment = moments["right knee.rate"][swing], moments["right knee.moment"][swing]
damper = -float(rate @ moment / (rate @ rate))

# another ankle, with the damper that was found
runs = [mbd.simulate(*walker(damper, k), integrator, dt=dt, until=until) for k in (160.0, 240.0)]

if __name__ == "__main__":
    print(motion, moments, f"damper {damper:.3f} N m s/rad", mbd.gait_report(*runs, names=("soft", "stiff")), sep="\n")
