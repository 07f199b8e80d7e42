"""A uniform rod swings on a pin, released at rest from the horizontal.

The moment of inertia about the pin is m L²/3, so the rod moves like a simple pendulum of length 2 L/3. Its period is
4 √(2 L/3 g) K(sin² θ₀/2), with K the complete elliptic integral of the first kind of parameter m = k². Energy and the
centripetal acceleration give the pull of the pin at the lowest point: m g (1 + 3/2 (1 − cos θ₀)) = 5/2 m g.

Any textbook has it, such as J. L. Meriam & L. G. Kraige, Engineering Mechanics: Dynamics, chapter 6.
"""

import math

import mbd

model = mbd.Model("pendulum")
rod = mbd.Link("rod", length=1.0, **mbd.rod(mass=2.0, length=1.0).link)
model.connect(mbd.Revolute("pin", model.ground.origin, rod.start))

start = mbd.assemble(model, position={"pin.angle": math.pi / 2})
integrator, dt, until = mbd.GeneralizedAlpha(rho_inf=0.9), 1e-3, 4.0
