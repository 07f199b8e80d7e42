"""Singular configurations: where the constraint Jacobian B loses rank for an instant, and how steps get over them.

A four-bar whose bars lie in line, a slider-crank with equal arms or a parallelogram that is flat can leave on two
branches. With x the distance from the configuration, the singularity for short, along the motion, and y across it, a
row is like h = x y there. Its two rates, ``ḣ = x ẏ + ẋ y`` and ``ḧ = x ÿ + 2 ẋ ẏ + ẍ y``, say what goes wrong:

- Round-off δ of h leaves y open by δ/x; ḣ = 0 makes of that a velocity ẏ that is wrong by ẋ δ/x², and a step that holds
  h alone one of δ/(x dt), which is less within a step of the singularity.
- Accelerations with ḧ = 0 make of a velocity ẏ that a stage is off the branch ``ÿ = −2 ẋ ẏ/x``.
- A Newton matrix made on one side has the sign of x of that side, and fails stages on the other.

How far off it is follows from what Gram–Schmidt leaves of each row of B beside the others (`gram_norms`; `step_size` in
the order of the rows): that length vanishes there, and its change in a step tells in how many.

What a scheme does is an ability of its entry (`mbd.kernel.schemes.contract`):

- The Newmark family steps over it itself (`newmark_step`): within a few steps of it h alone is held, ḣ left alone;
  then velocities are projected onto the rows and the scheme restarts (`leave`). No step may end next to it: two steps
  of other sizes, which err like whole ones, move their ends by half a step (`step_pairs`).
- For schemes with stages the size of the step is chosen so that it lies between two nodes (`step_size`), in a longer
  step where round-off asks for that; where round-off would be more than 1e-5 of the velocities even so, the run ends.
- Radau IIA, which holds rows at its stages too, holds each of them to its own rows in such a step (`stages`).

Events next to it that change nothing are found on the interpolant of the step; one that changes something ends the run,
since no scheme can restart from there (`events`).
"""
