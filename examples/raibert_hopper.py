"""A one-legged hopper keeps its height, its speed and its posture by three laws that know nothing of each other.

Height: as the leg is compressed most, its spring is made longer until the foot leaves the ground. Speed: in flight the
leg is swung to where the foot must come down, half the way of the last stance ahead of the hip, and farther the faster
it is than wanted. Posture: in stance the hip turns the body upright.

M. H. Raibert, Legged Robots That Balance, MIT Press (1986), ch. 2.
"""

import mbd

model = mbd.Model("Raibert hopper")
body = mbd.RigidBody("body", mass=10.0, inertia=1.0)
leg = mbd.Link("leg", mass=0.5, length=0.4, center=0.2, inertia=0.01)
foot = mbd.PointMass("foot", mass=0.1)
hip = mbd.Revolute("hip", body.origin, leg.start)
slide = mbd.Prismatic("slide", leg.end, foot.origin, axis=(0, -1, 0), stiffness=4e3, rest=0.2, loss=mbd.Viscous(20.0))
model.connect(mbd.Planar("trunk", model.ground.origin, body.origin), hip, slide)
model.constrain(mbd.Unilateral("toe", mbd.touchdown(foot.origin)))
lands, leaves = mbd.Transition("off", "on", on="toe"), mbd.Transition("on", "off", on="toe opened")
thrusts = mbd.Transition("compression", "thrust", when="slide.rate", direction=1)
both = mbd.Transition(("compression", "thrust"), "flight", on="toe opened")
phases, own = ("flight", "compression", "thrust"), {"speed": 1.2, "gain": 0.03}
phase = mbd.Mode("phase", phases, transitions=[mbd.Transition("flight", "compression", on="toe"), thrusts, both],
                 numbers=own, remembers={"stance time": {"flight": "stance.time"}},
                 sets={"slide spring.rest": {"thrust": 0.22}})  # fmt: skip
model.apply(phase, mbd.Mode("stance", ("off", "on"), transitions=[lands, leaves]))


def place(leg_angle, leg_rate, body_angle, body_rate, speed, wanted, gain, time):
    ahead = 0.5 * speed * time + gain * (speed - wanted)
    goal = mbd.asin(mbd.clip(ahead / 0.6, -0.6, 0.6))
    return -60.0 * (body_angle + leg_angle - goal) - 4.0 * (body_rate + leg_rate)


def upright(leg_angle, leg_rate, body_angle, body_rate, *_):
    return 100.0 * body_angle + 40.0 * body_rate


names = ["hip.angle", "hip.rate", "trunk.angle", "trunk.angle.rate", "trunk.x.rate"]
names += ["phase.speed", "phase.gain", "phase.stance time"]
laws = {"flight": place, "compression": upright, "thrust": upright}
model.apply(mbd.Motor("hip drive", hip, torque=laws, by="phase", arguments=names))
start = mbd.assemble(model, {"trunk.y": 1.0, "slide.displacement": 0.2, "trunk.angle": 0.0}, {"trunk.x.rate": 0.0})
integrator, dt, until = mbd.RungeKutta853(), 2e-3, 10.0
