"""A billiard ball struck with side spin and draw slides on a parabola, grips the cloth, and rolls straight on.

While it slides, friction μ m g acts against the slip u = v − R ω × n of the point that touches, whose direction stays:
the path is a parabola for the time 2 |u₀|/(7 μ g), and the ball rolls with v₀ − 2 u₀/7 from there. The spin about the
normal goes on (G. G. Coriolis, Théorie mathématique des effets du jeu de billard, 1835).
"""

import mbd

m, R, mu = 0.17, 0.0286, 0.2  # kg, m, -
model = mbd.Model("billiard ball")
ball = mbd.RigidBody("cue ball", **mbd.sphere(m, R).body)
model.connect(mbd.Free("roll", model.ground.origin, ball.origin))
model.constrain(mbd.Unilateral("cloth", mbd.sphere_touchdown(ball.origin, R), friction=mu))

start = mbd.assemble(
    model,
    position={"roll.y": R},
    velocity={"roll.x": 2.0, "roll.angular_velocity": (40.0, 30.0, 60.0)},  # to the side, about the normal, back
    closed="cloth",
)
integrator, dt, until = mbd.RungeKutta853(), 2.5e-4, 0.7
