"""What counts as equal, as zero or as one instant where numbers were found in different ways, in one table.

What the kernel compares these with are scales of the mechanism (`mbd.kernel.stepping.scales`) or terms of the same sum;
others ask about results: two states, two sides, two rows of a matrix, each relative to its own size.
"""

SMALL_SUM_RTOL = 1e-14
"""Round-off of a sum of few terms, relative to the largest of them [-]."""
ROUND_OFF_RTOL = 1e-12
"""Round-off of sums of many terms, of solutions and of programs, relative to the largest of their terms [-]."""
LAW_RTOL = 1e-11
"""What multipliers, velocities or accelerations may miss of their laws of contact, relative to their terms [-]."""
EQUAL_RTOL = 1e-9
"""Difference, relative to 1 or to the largest of its kind, below which numbers found in two ways are equal [-]."""
HALF_PRECISION_RTOL = 1e-8
"""Half of all digits, √ε: less than this of its terms is no pivot, rank, slope, force or violation [-]."""
NOMINAL_RTOL = 1e-6
"""Difference, relative to 1 or its size, below which numbers are equal that were written, measured or converged [-]."""
DIRECT_PIVOT_RTOL = 1e-4
"""Part of its terms that a pivot keeps where a solution is taken as it is: at most four of sixteen digits are lost."""
RANK_RTOL = 1e-9
"""Singular value, relative to the largest, below which one of the rows depends on others [-]."""
INSTANT_RTOL = 1e-9
"""Share of a run or a step within which two instants are one [-]."""
BRACKET_RTOL = 1e-12
"""Width of a bracket, over the range of its parameter, at which a point counts as located [-]."""
REST_SPEED = 1e-9
"""Speed, relative to 1 or to the fastest, below which two surfaces neither slide nor approach [m/s, rad/s, -]."""
MIN_SQUARED_SPEED = 1e-60
"""Square of a speed that is none, beside which a direction is defined [m²/s², rad²/s²]."""
MIN_DIVISOR = 1e-200
"""What is added to a number that may be zero before it divides [any unit]."""
