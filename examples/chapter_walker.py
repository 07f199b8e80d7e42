"""A passive walker of human size: thigh, shank and foot on each leg, knees that are free up to a rubber stop.

No lock and no motor. The swing knee bends by itself and swings out until it meets its stop, a spring and a damper: a
penalty contact that pushes and never pulls. In stance the weight keeps the knee on its stop, because the foot meets the
ground a little ahead of the shank's axis. That foot sticks by Lagrange multipliers until the other one strikes, and
takes no impulse from the strike (McGeer's rule). HHT with 5 % damping quiets the stiff stops.

T. McGeer, Passive walking with knees, Proc. IEEE Conf. Robotics and Automation (1990) 1640. Uniform rods of 7 and
3.5 kg make a person of 70 kg. Slope and place of the foot were found by random search: from the straight legs below
it settles within ten steps into a steady walk, the fixed point of its return map (0.426 m in 0.865 s). With the foot
30 mm ahead it limps, and with 5 mm its stance knee gives way: the event 'fall' ends the run.
"""

import mbd

ahead = 0.02  # of the shank's axis, where the foot meets the ground [m]
model = mbd.Model("chapter walker", gravity=mbd.on_slope(0.03))
hip = mbd.PointMass("hip", mass=47.0)
model.connect(mbd.Translation("trunk", model.ground.origin, hip.origin))
for side, other in ("left", "right"), ("right", "left"):
    thigh = mbd.Link(f"{side} thigh", length=0.43, **mbd.rod(mass=7.0, length=0.43).link)
    shank = mbd.Link(f"{side} shank", length=0.42, **mbd.rod(mass=3.5, length=0.42).link)
    sole = mbd.PointMass(f"{side} sole", mass=1.0)
    knee = mbd.Revolute(f"{side} knee", thigh.end, shank.start)
    ankle = mbd.Weld(f"{side} ankle", shank.point(ahead, -0.42), sole.origin)
    model.connect(mbd.Revolute(f"{side} hip", hip.origin, thigh.start), knee, ankle)
    model.constrain(
        mbd.Unilateral(f"{side} foot", mbd.touchdown(sole.origin), release=mbd.When(f"{other} foot")),
        mbd.Penalty(f"{side} knee stop", mbd.flexion(knee), stiffness=5000.0, damping=20.0, release="pull"),
    )
model.constrain(mbd.Event("fall", mbd.measure(lambda p: p[1] - 0.5, hip.origin), terminal=True))

start = mbd.assemble(
    model,
    closed="left foot",
    open="right foot",  # about to leave the ground
    position={"left hip.angle": 0.2265, "right hip.angle": -0.2735, "left knee.angle": 0.0, "right knee.angle": 0.0},
    velocity={"left hip.angle": -1.0, "right hip.angle": -0.15, "left knee.angle": 0.0, "right knee.angle": 0.0},
)
integrator, dt, until = mbd.HHT(alpha=0.05), 1e-3, 15.0
