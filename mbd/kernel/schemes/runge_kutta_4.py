"""The explicit Runge–Kutta scheme of order 4 (Kutta 1901, Z. Math. Phys. 46:435, p. 443).

Its error is estimated by the slope k₅ at the end of the step: ``dt (k₄ − k₅)/6``. With these five slopes the formulas
of order 3 at least are ``b + s (0, 0, 0, 1, −1)``: c = (0, ½, ½, 1, 1) and A c = (0, 0, ¼, ½, ½) leave no other
direction in which Σ b, Σ b c, Σ b c² and Σ b A c stay as they are. s = −1/6 takes k₅ in the place of k₄.
"""

from mbd.kernel.schemes.runge_kutta import explicit_scheme
from mbd.kernel.schemes.tableau import FOURTH_ORDER

SCHEME = explicit_scheme("runge-kutta-4", FOURTH_ORDER, 0.75, 2.828, 1)
"""Its middle lies between the nodes at 1/2 and 1."""
