"""The table of scales: what counts as round-off for coordinates, speeds, energies and forces where terms vanish.

A judgement by the terms present alone has no meaning where these are zero: at rest, at constant speed, where forces
balance or nothing acts. So each quantity has a floor that follows from the mechanism and the way so far, in any units:

    extent L        the largest of the terms of rows in metres, of coordinates in metres that add, of √(Σ J/Σ m)
    coordinate X_i  1 of an angle, L of a length
    speed           ε′ X_i/Δt, ε′ = 10⁻¹²: a motion so slow takes 10¹² steps to go its own size
    energy          Σ ½ M_ii speed_i², each coordinate with its own mass: a ton says nothing of a gram
    force           the largest of E/X_i, E = ½ v·M v, of M_ii (|v_i|/Δt + X_i/(1000 Δt)²), and of the torques over L
                    or the forces times L, all of its cluster: what elimination, which mixes these, leaves of one in
                    another

Who asks: `still_speed`, `still_energy` bound speeds and energies below which a mechanism is at rest (M must be in
K.acc, as `evaluate` leaves it): no ratio to a smaller one is a judgement of a step. `add_force_floors` is for residuals
that Newton's method reduces no more, and for nothing else: a step that can be solved more tightly is.
The extent is noted at accepted states, where scales are measured (`note_extent`) and as it is asked for (`note_way`);
it only grows.
"""

from mbd.equal import ROUND_OFF_RTOL
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.codes import ACCELERATIONS, EPS, SCALES
from mbd.kernel.hooks import call
from mbd.kernel.records import Equations, Motion

HORIZON_STEPS = 1000.0
"""Steps in which the least force that counts would move a coordinate by its own size [-]."""
FORCE_ULPS = 4096.0
"""Round-off of forces, in units of the last place of their floors: that of many terms, and of elimination [-]."""


def note_extent(K: Equations) -> None:
    """Raise K.extent to what terms of rows tell of it at the accepted state, which is in the block; K.work is lost."""
    call(K, SCALES, K.work)
    for k in range(K.n_rows):
        if K.row_unit[k] == 0 and K.row_level[k] == 0 and K.work[K.n + k] < 1e300:
            K.extent = max(K.extent, K.work[K.n + k])


def note_way(K: Motion) -> None:
    """The same by coordinates that add, and by √(Σ J/Σ m), M in K.acc: a body at the origin has a length, too."""
    mass = 0.0
    inertia = 0.0
    extent = K.extent
    for i in range(K.n_v):
        entry = abs(K.acc[i * K.n + i])
        if K.unit[i] == 0:
            mass += entry
            if K.vector == 1:
                extent = max(extent, abs(K.q[i]))
        elif K.unit[i] == 1:
            inertia += entry
    if mass > 0.0 and inertia < 1e300 * mass:
        extent = max(extent, sqrt(inertia / mass))
    K.extent = extent


def size_of(K: Motion, i: int) -> float:
    """X_i, the size of coordinate i [m, rad]."""
    return float(K.extent) if K.unit[i] == 0 else 1.0


def still_speed(K: Motion, i: int) -> float:
    """Speed of coordinate i at which it is at rest [m/s, rad/s]."""
    return ROUND_OFF_RTOL * size_of(K, i) / K.dt


def still_energy(K: Motion) -> float:
    """Kinetic energy of a mechanism whose coordinates are all at rest, M in K.acc [J]."""
    note_way(K)
    energy = 0.0
    for i in range(K.n_v):
        speed = still_speed(K, i)
        energy += 0.5 * abs(K.acc[i * K.n + i]) * speed * speed
    return energy


def speed_round_off(K: Motion, row: int) -> float:
    """Speed along a row that may be round-off of any motion of its cluster, M and B in K.acc [m/s, rad/s].

    Elimination mixes speeds as it mixes forces: with the kinetic energy of the cluster each coordinate of the row would
    move at √(2 T/M_ii). The row's own terms say nothing where its bodies rest in what moves.
    """
    n = K.n
    energy = 0.0
    for i in range(K.n_v):
        if K.cluster[i] == K.cluster[n + row]:
            momentum = 0.0
            for j in range(K.n_v):
                momentum += K.acc[i * n + j] * K.y[j]
            energy += 0.5 * momentum * K.y[i]
    speed = max(K.scale[n + K.n_rows + row], 1e-3)
    for i in range(K.n_v):
        slope = abs(K.acc[K.acc_B + row * n + i])
        mass = abs(K.acc[i * n + i])
        if slope > 0.0 and 2.0 * slope * slope * energy > speed * speed * mass and mass > 0.0:
            speed = slope * sqrt(2.0 * energy / mass)
    return float(ROUND_OFF_RTOL * speed)


def unseen_force(K: Motion, row: int) -> float:
    """Force along a row that changes the speeds of its cluster by no unit of the last place in a step [N, N m].

    Where nothing acts all forces are round-off of such a size, of either sign. M in K.acc.
    """
    largest = 0.0
    for i in range(K.n_v):
        if K.cluster[i] == K.cluster[K.n + row] and K.unit[i] == K.row_unit[row]:
            largest = max(largest, EPS * abs(K.acc[i * K.n + i] * K.y[i]) / K.dt)
    return largest


def load_accepted(K: Equations) -> None:
    """The accepted positions and velocities into the block; those of an iterate, there until now, into K.work."""
    kept = K.n + 2 * K.n_rows  # before it are magnitudes
    K.work[kept : kept + K.n_v] = K.block[K.o_x : K.o_x + K.n_v]
    K.work[kept + K.n_v : kept + K.n_v + K.n] = K.block[K.o_v : K.o_v + K.n]
    K.block[K.o_x : K.o_x + K.n_v] = 0.0
    K.block[K.o_v : K.o_v + K.n] = K.y[: K.n]


def restore_iterate(K: Equations) -> None:
    """Those of `load_accepted` back into the block."""
    kept = K.n + 2 * K.n_rows
    K.block[K.o_x : K.o_x + K.n_v] = K.work[kept : kept + K.n_v]
    K.block[K.o_v : K.o_v + K.n] = K.work[kept + K.n_v : kept + K.n_v + K.n]


def add_force_floors(K: Equations, part: float) -> None:
    """Raise K.scale of forces to a part of their floors; K.acc is overwritten by that at the accepted state.

    The block is at an iterate, which may be thrown far away: floors are those of the accepted state and of the scales
    in K.known, as `note_scales` leaves them. With a part of `FORCE_ULPS` ε over a tolerance, a residual of round-off
    passes at that tolerance.
    """
    load_accepted(K)
    call(K, ACCELERATIONS, K.acc)
    restore_iterate(K)
    note_way(K)
    for c in range(K.n_clusters):
        add_floors_of_cluster(K, part, c)
    for i in range(K.n):
        K.weight[i] = 1.0 / K.scale[i]


def add_floors_of_cluster(K: Motion, part: float, c: int) -> None:
    """The same of the coordinates of one cluster: elimination mixes no others into them."""
    n = K.n
    energy = 0.0
    force = 0.0
    torque = 0.0
    for i in range(K.n_v):
        if K.cluster[i] == c:
            momentum = 0.0
            for j in range(K.n_v):
                momentum += K.acc[i * n + j] * K.y[j]
            energy += 0.5 * momentum * K.y[i]
            if K.unit[i] == 0:
                force = max(force, K.known[i])
            else:
                torque = max(torque, K.known[i])
    slowly = 1.0 / (HORIZON_STEPS * K.dt * HORIZON_STEPS * K.dt)
    for i in range(K.n_v):
        if K.cluster[i] == c:
            size = size_of(K, i)
            mass = abs(K.acc[i * n + i])
            floor = mass * (abs(K.y[i]) / K.dt + size * slowly)
            if K.unit[i] == 1:
                floor = max(floor, max(energy, force * K.extent))
            elif size > 0.0:
                floor = max(floor, max(energy, torque) / size)
            if floor < 1e300:
                K.scale[i] = max(K.scale[i], part * floor)
