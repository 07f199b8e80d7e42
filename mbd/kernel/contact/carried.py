"""What sticks on rows that prescribe its motion slides from the instant at which they move it.

There the row of the friction holds nothing, and has no force of its own that could reach its limit. As a drive leaves
its rest smoothly, what it moves has neither speed nor acceleration yet; the motion of a step tells that it slides, and
which way.
"""

from mbd.equal import REST_SPEED
from mbd.kernel.contact.cones import aim, follows, set_loose, set_sticking
from mbd.kernel.records import DependentRows, Switching


def prescribed_rate(K: DependentRows, row: int) -> float:
    """What time alone makes of the rate of a row that was left out, B_d = C B: its own h_t less C h_t of the others.

    h_t = ḣ − B v; K.acc is that of the candidate.
    """
    value = 0.0
    for i in range(K.n_rows):
        if i == row or K.dropped[i] == 0:
            part = 1.0 if i == row else -K.dependence[row * K.n_rows + i]
            if part != 0.0:
                rate = K.acc[K.acc_h + K.n_rows + i]
                for j in range(K.n):
                    rate -= K.acc[K.acc_B + i * K.n + j] * K.y1[j]
                value += part * rate
    return float(value)


def is_carried(K: DependentRows, f: int) -> bool:
    """Whether the group of a friction that sticks, which f leads, is moved by the candidate as motion is prescribed."""
    fastest = 0.0
    small = 1.0
    for g in range(f, f + K.group_size[f]):
        row = K.friction_row[g]
        small = max(small, 1e-2 * K.scale[K.n + K.n_rows + row])
        if K.dropped[row] == 1:
            fastest = max(fastest, abs(prescribed_rate(K, row)))
    return bool(fastest > REST_SPEED * small)


def slides_as_carried(K: Switching) -> bool:
    """Whether what sticks at the start of the step is carried by it: it slides from there on, and is restarted."""
    found = False
    for f in range(K.n_frictions if K.restarted_here == 0 and K.near_singular == 0 else 0):
        if K.sticks[f] == 1 and not follows(K, f) and is_carried(K, f):
            set_sticking(K, f, 0)
            set_loose(K, f, 3)
            for g in range(f, f + K.group_size[f]):
                K.slip[g] = prescribed_rate(K, K.friction_row[g]) if K.dropped[K.friction_row[g]] == 1 else 0.0
            aim(K, f)
            found = True
    if found:
        K.restarted_here = 1
        K.restart_due = 1
    return found
