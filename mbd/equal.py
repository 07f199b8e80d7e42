"""What counts as equal, as zero or as one instant where numbers were found in different ways, in one table.

The kernel judges its own numbers by scales of the mechanism (`mbd.kernel.stepping.scales`); what is here asks about
results: two states, two sides, two rows of a matrix, each relative to its own size.
"""

from __future__ import annotations

__all__ = ["BRACKET_RTOL", "EQUAL_RTOL", "INSTANT_RTOL", "RANK_RTOL", "REST_SPEED", "ROUND_OFF_RTOL"]

ROUND_OFF_RTOL = 1e-12
"""Difference of two programs of one expression, relative to the largest of its terms [-]."""
EQUAL_RTOL = 1e-9
"""Difference, relative to 1 or to the largest of its kind, below which numbers found in two ways are equal [-]."""
RANK_RTOL = 1e-9
"""Singular value, relative to the largest, below which one of the rows depends on others [-]."""
INSTANT_RTOL = 1e-9
"""Share of a run within which two instants are one [-]."""
BRACKET_RTOL = 1e-12
"""Width of a bracket, over the range of its parameter, at which a point counts as located [-]."""
REST_SPEED = 1e-9
"""Speed, relative to 1 or to the fastest, below which two surfaces neither slide nor approach [m/s, rad/s, -]."""
