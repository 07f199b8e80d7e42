"""A tippe-top turns over: friction at its tip lifts the center of mass of a spinning ball that is heavy below.

A ball of radius R whose center of mass lies by a below its middle, on a plane with friction ``F = −μ N u`` opposite to
the velocity u of the point of contact. Whatever that force is, Jellett's ``L · (R e_z − a e)`` stays, so that the spin
about the vertical must fall as the axis e turns over. R. J. Cohen, The tippe top revisited, Am. J. Phys. 45 (1977) 12.
"""

import math

import mbd

m, R, a = 0.006, 0.015, 0.0045  # kg, m, m
A, C = 5.052857142857143e-07, 5.4e-07  # kg m², across the axis and about it
model = mbd.Model("tippe-top", gravity=(0.0, -9.81, 0.0))
top = mbd.RigidBody("top", m, (A, C, A))
model.connect(mbd.Free("float", model.ground.origin, top.origin))
ball = mbd.sphere_touchdown(top.point(0.0, a, 0.0, name="middle"), R)
model.constrain(mbd.Unilateral("tip", ball, friction=mbd.Viscous(0.3)))  # μ in s/m

tilt, spin = 0.1, 155.0  # rad, rad/s
start = mbd.assemble(
    model,
    position={"float.y": R - a * math.cos(tilt), "float.orientation": ((0, 0, 1), tilt)},
    velocity={"float.angular_velocity": (0.0, spin, 0.0)},
    closed="tip",
)
integrator, dt, until = mbd.RungeKutta853(), 2e-3, 7.0
