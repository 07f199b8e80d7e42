"""A wheel without a rim rolls down a slope on its eight spokes: the simplest model of walking.

Between two spokes the wheel is an inverted pendulum. Each spoke that strikes stops dead without slipping; angular
momentum about it is kept, so that with all mass in the hub the speed after a strike is cos(2π/n) times that before.
What the slope gives, ω² += 4 g/L sin(π/n) sin γ a step, the strike takes: the wheel rolls at a steady speed, and after
a disturbance the difference in ω² shrinks by cos²(2π/n) each step.

T. McGeer, Passive dynamic walking, Int. J. Robotics Research 9 (1990) 62.
"""

import math

import mbd

spokes, length, slope = 8, 1.0, 0.1
half = math.pi / spokes  # angle between a spoke and the bisector to the next
steady = math.cos(2 * half) * math.sqrt(4 * 9.81 / length * math.sin(half) * math.sin(slope)) / math.sin(2 * half)

model = mbd.Model("rimless wheel", gravity=mbd.on_slope(slope))
hub = mbd.RigidBody("hub", mass=1.0, inertia=(0.0, 0.0, 0.0))
model.connect(mbd.Planar("wheel", model.ground.origin, hub.origin))
for k in range(spokes):
    tip = hub.point(length * math.sin(2 * half * k), -length * math.cos(2 * half * k))
    model.constrain(mbd.Unilateral(f"spoke {k + 1}", mbd.touchdown(tip)))

# It starts on spoke 1, which leans back by half a spoke angle; rolling along +x is turning about −z.
start = mbd.assemble(model, closed="spoke 1", position={"wheel.angle": half}, velocity={"wheel.angle": -steady})
integrator, dt, until = mbd.HHT(alpha=0.05), 1e-3, 8.0
