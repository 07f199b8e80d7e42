"""A walker with a prosthetic leg limps down a slope.

The left leg is sound. On the right a light shank and a light foot stand in for flesh; a hydraulic cylinder takes energy
out of the knee (an orifice, torque ∝ rate², beside viscous friction), and the foot hangs on an elastic ankle whose
damping is a table of rates and torques, as a test bench gives it. No knee is driven: each swings out to a rubber stop,
which pushes only, and in stance the weight holds it there, since the foot meets the ground a little ahead of the ankle.

The sound leg has the masses of a person of 70 kg, as in chapter_walker.py; the prosthesis, the slope and the places of
the feet were found by random search for a walk that lasts and loads no foot by more than 1.35 body weights. It settles
to strides of two unequal steps.
"""

import mbd

model = mbd.Model("prosthetic leg", gravity=mbd.on_slope(0.025))
hip = mbd.PointMass("hip", mass=47.0)
model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))


def leg(side, other, masses, ahead, knee_loss=None, **ankle):
    """One leg of thigh, shank and foot [kg], whose foot meets the ground `ahead` of the ankle [m] and 80 mm below."""
    thigh = mbd.Link(f"{side} thigh", length=0.43, **mbd.rod(masses[0], length=0.43).link)
    shank = mbd.Link(f"{side} shank", length=0.34, **mbd.rod(masses[1], length=0.34).link)
    foot = mbd.RigidBody(f"{side} foot", mass=masses[2], inertia=(0.003, 0.003, 0.003), center=(0.0, -0.05, 0.0))
    knee = mbd.Revolute(f"{side} knee", thigh.end, shank.start, loss=knee_loss)
    model.connect(mbd.Revolute(f"{side} hip", hip.origin, thigh.start), knee)
    model.connect((mbd.Revolute if ankle else mbd.Weld)(f"{side} ankle", shank.end, foot.origin, **ankle))
    ball = mbd.touchdown(foot.point(ahead, -0.08))
    model.constrain(
        mbd.Unilateral(f"{side} ball", ball, release=mbd.When(f"{other} ball")),
        mbd.Penalty(f"{side} knee stop", mbd.flexion(knee), stiffness=1300.0, restitution=0.4),
    )


hydraulic_knee = mbd.Viscous(0.7) + mbd.Quadratic(0.1)
tabulated_ankle = mbd.Tabulated(rate=[-30.0, -6.0, -2.0, 2.0, 6.0, 30.0], torque=[-24.0, -8.0, -4.0, 4.0, 8.0, 24.0])
leg("left", "right", masses=(7.0, 3.5, 1.0), ahead=0.01)
leg("right", "left", (7.0, 2.1, 0.7), 0.0025, hydraulic_knee, stiffness=160.0, loss=tabulated_ankle)
model.constrain(mbd.Event("fall", mbd.measure(lambda p: p[1] - 0.5, hip.origin), terminal=True))

start = mbd.assemble(
    model,
    closed="left ball",
    open="right ball",  # about to leave the ground
    position={"left hip.angle": 0.204, "right hip.angle": -0.263, "left knee.angle": 0.0, "right knee.angle": 0.0},
    velocity={"left hip.angle": -0.9, "right hip.angle": -0.31, "left knee.angle": 0.0, "right knee.angle": 0.0},
)
integrator, dt, until = mbd.HHT(alpha=0.05), 1e-3, 20.0
