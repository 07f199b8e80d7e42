"""A tennis racket, thrown with a spin about the axis across its face, turns over about its handle by itself.

Of the three principal axes the middle one is unstable: the racket flips by half a turn again and again, of which the
time between flips is 2 K(m)/Ω of Euler's equations, with K the complete elliptic integral of the first kind, while its
angular momentum in space and its energy stay and its center flies a parabola.

M. S. Ashbaugh, C. C. Chicone & R. H. Cushman, The twisting tennis racket, J. Dyn. Differ. Equ. 3 (1991) 67; L. D.
Landau & E. M. Lifshitz, Mechanics, §37. Dzhanibekov saw it in a wing nut aboard Salyut 7 in 1985.
"""

import mbd

model = mbd.Model("tennis racket")
racket = mbd.RigidBody("racket", 0.33, (0.0152, 0.0014, 0.0166))  # about x across, y along the handle, z off the face
racket.point(0.0, 0.3, 0.0, name="head")
racket.point(0.0, -0.35, 0.0, name="handle")
racket.point(-0.12, 0.15, 0.0, name="left edge")
racket.point(0.12, 0.15, 0.0, name="right edge")
model.connect(mbd.Free("flight", model.ground.origin, racket.center))

start = mbd.assemble(
    model,
    position={"flight.y": 1.5},
    velocity={"flight.y": 5.0, "flight.angular_velocity": (18.0, 1.0, 0.0)},
)
integrator, dt, until = mbd.GeneralizedAlpha(rho_inf=0.9), 2e-4, 1.4
