"""A person without a left shank kicks in free fall: what a prosthetic leg changes, nothing from outside can.

The right leg is of flesh; on the left a light shank hangs on a hydraulic knee, a part of planar legs that serves in
space as it is, with a blade of a foot on a spring. Knees, arms and a hip swing; damping takes a tenth of the energy,
the center of mass goes straight on (weight is left out), and the pelvis, which began without a turn, turns by 12°.
"""

import mbd

person = mbd.human(mass=70.0, height=1.75, sex="female").without("left shank")
model = mbd.Model("amputee in space", gravity=(0.0, 0.0, 0.0))
model.connect(*person.joints)

stump = person.bodies["left thigh"].end
shank = mbd.Link("left shank", mass=1.2, length=0.4, center=0.18, inertia=mbd.cylinder(1.2, 0.03, 0.4, "y").inertia)
blade = mbd.RigidBody("left foot", 0.6, (0.0006, 0.002, 0.002), center=(0.05, -0.05, 0.0))
rubber = {"stiffness": 1300.0, "restitution": 0.4}
valves = {"flexion": 0.8, "extension": 0.2, "stop": rubber, "anatomy": "left knee"}  # of the same joint as the other
knee = mbd.parts.hydraulic_knee(model, "left knee", stump, shank.start, **valves)
spring = {"stiffness": 160.0, "loss": mbd.Viscous(0.5), "anatomy": "left ankle"}
ankle = mbd.Revolute("left ankle", shank.end, blade.origin, **spring)
model.connect(ankle)

rates = {"left knee.angle": -6.0, "right knee.angle": -5.0, "left shoulder.angular_velocity.z": 3.0}
rates |= {"right shoulder.angular_velocity.z": -3.0, "left hip.angular_velocity.x": -1.0}
rates["back.angular_velocity.y"] = 1.0
start = mbd.assemble(model, velocity=rates, position={"left knee.angle": -0.3, "right knee.angle": -0.3})
integrator, dt, until = mbd.GeneralizedAlpha(rho_inf=0.9), 1e-3, 0.5
