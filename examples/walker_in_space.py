"""A walker that rocks from side to side: straight legs, disk feet, hips of a width; no motor, and no balance.

A. D. Kuo, Stabilization of lateral motion in passive dynamic walking, Int. J. Robotics Res. 18 (1999) 917, gave a
passive walker one freedom more, to the side, beside the two of its legs: it walks stably forward, and falls sideways.
So does this one. Its numbers are not those of the paper, but of the same kind: legs of 1 m, a sixth of the mass each.
"""

import mbd

g, slope, reach, width = 9.81, 0.03, 0.3, 0.2  # m/s², rad; radius of the feet and distance of the hips [m]
model = mbd.Model("walker in space", gravity=mbd.on_slope(slope, g))
trunk, pelvis = mbd.PointMass("trunk", 45.0), mbd.RigidBody("pelvis", 0.1, (0.1, 0.1, 0.1))
model.connect(mbd.Translation("place", model.ground.origin, trunk.origin, axes="xyz"))
model.connect(mbd.Revolute("roll", trunk.origin, pelvis.origin, axis=(1, 0, 0)))
legs = {side: mbd.RigidBody(f"{side} leg", 12.0, (0.5, 0.04, 0.5), center=(0, -0.36, 0)) for side in ("left", "right")}
feet = {side: leg.point(0.0, reach - 1.0, 0.0, name="arch") for side, leg in legs.items()}
for side, other, outward in ("left", "right", -0.5), ("right", "left", 0.5):
    socket = pelvis.point(0.0, 0.0, outward * width, name=f"{side} socket")
    model.connect(mbd.Revolute(f"{side} hip", socket, legs[side].origin))
    ahead = mbd.measure(lambda this, that: this[0] - that[0] - 0.1, feet[side], feet[other])  # by 0.1 m
    edge, axle = mbd.disk_touchdown(feet[side], reach, axis=(0, 0, 1)), (0, 0, 1)
    release = mbd.When(f"{other} foot")
    model.constrain(mbd.Unilateral(f"{side} foot", edge, friction=0, release=release, only_while=ahead))
    model.constrain(mbd.Rolling(f"{side} grip", feet[side], reach, only_while=f"{side} foot", axis=axle))

guess = mbd.assemble(
    model,
    closed="left foot",
    position={"left hip.angle": 0.326, "right hip.angle": -0.317, "roll.angle": -0.0099},
    velocity={"left hip.angle": -1.127, "right hip.angle": -0.560, "roll.angle": -0.2544},
)
gait = mbd.limit_cycle(model, guess, section="right foot", mirror=("left", "right"))
start, integrator, dt, until = gait.state, mbd.RungeKutta853(), 0.005, 2.0
if __name__ == "__main__":
    print(gait, "multipliers", gait.multipliers.round(4), sep="\n")
