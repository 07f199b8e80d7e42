"""A bead slides off a frictionless dome: a contact whose gap is a function of one's own.

The gap is the distance to the dome; any function of positions, angles and time may stand in its place, and the normal
direction, the curvature terms and the release follow from it. On the dome m g cos θ − N = m v²/R, and energy gives v².
The bead leaves where N falls to zero, at cos θ = 2/3 + v₀²/(3 g R), whatever its mass, and lands on a parabola.

From rest that is R/3 below the top, a problem in every text, such as D. Kleppner & R. Kolenkow, An Introduction to
Mechanics, chapter 4. The event 'landing' ends the run.
"""

import mbd

radius, push = 1.0, 0.5  # m, m/s


def distance_to_dome(place):
    """√(x² + y²) − R of the bead's place (x, y, z) [m]."""
    x, y, _ = place
    return mbd.sqrt(x * x + y * y) - radius


model = mbd.Model("bead on a dome")
bead = mbd.PointMass("bead", mass=0.2)
model.connect(mbd.Translation("slide", model.ground.origin, bead.origin))
model.constrain(
    mbd.Unilateral("dome", mbd.measure(distance_to_dome, bead.origin)),
    mbd.Event("landing", mbd.height(bead.origin), terminal=True),
)

start = mbd.assemble(
    model, closed="dome", position={"slide.x": 0.0, "slide.y": radius}, velocity={"slide.x": push, "slide.y": 0.0}
)
integrator, dt, until = mbd.GeneralizedAlpha(rho_inf=0.9), 1e-3, 2.0
