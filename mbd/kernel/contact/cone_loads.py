"""Redundant feet that stick: a load that they can share so that all of them stay in their cones, if there is one.

What the balance leaves open are multipliers ``λ + Z z`` with the same forces, Bᵀ Z = 0. Pushes keep their least norm
where they alone can share: z is orthogonal to that (in the metric W of `kernel.algebra.redundancy`). Of these are taken

1. λ itself, of least norm, where it lies in all cones;
2. else the ones nearest to it that do, ``min ‖z‖`` with ``‖λ_T‖ ≤ limit`` for each foot;
3. where there are none those which exceed the limits least, ``min σ`` with ``‖λ_T‖ ≤ limit + σ w``, w the limits of 1.

σ = 0 is the largest load that sticks, found from both sides: K.lam_at_limit has the multipliers of 3. They tell who
slips then and which way: σ rises with the power that the load has beyond that of friction in some motion of sliding
feet.
"""

from mbd.equal import HALF_PRECISION_RTOL, LAW_RTOL, ROUND_OFF_RTOL
from mbd.kernel.algebra.orthogonal import clear_row, square
from mbd.kernel.algebra.redundancy import largest_limit, share, sharing
from mbd.kernel.algebra.roots import sqrt
from mbd.kernel.contact.cones import follows, friction_size
from mbd.kernel.contact.discs import DISC_SIZE, disc_length, minimize_within_discs
from mbd.kernel.records import Balance, Complementarity, ContactForces, ContactRows, Frictions, Reals
from mbd.kernel.stepping.loads import evaluate_loaded, limit_of

MIN_WEIGHT_RATIO = 1e-4
"""w of such a foot over the largest limit [-]."""


def keep_in_cones(K: Balance, lam: Reals) -> None:
    """Multipliers of least norm become ones in all cones where there are such; K.dependence and K.limit are known.

    K.lam_at_limit has those at the largest load that sticks, or λ itself where it is in all cones.
    """
    K.lam_at_limit[: K.n_rows] = lam[: K.n_rows]
    if K.n_dropped == 0 or not exceeds(K, lam):
        return
    spans = find_freedoms(K, sharing(K))
    if spans == 0:
        return
    scale = largest_limit(K)
    discs = find_discs(K, lam, spans, scale)
    if discs == 0 or scale == 0.0:
        return
    sigma = find_brink(K, spans, discs)
    for row in range(K.n_rows):
        K.lam_at_limit[row] = lam[row] + scale * freed(K, row, spans)
    if sigma < -LAW_RTOL:  # the smallest freedoms within all discs, from those
        minimize_within_discs(K, spans, discs, True)
    for row in range(K.n_rows):
        lam[row] += scale * freed(K, row, spans)


def exceeds(K: Frictions, lam: Reals) -> bool:
    """Whether a contact that opens on pull pulls, or a friction that sticks is beyond its limit."""
    push = 0.0
    pull = 0.0
    for c in range(K.n_contacts):
        if K.kind[c] == 0 and K.opens[c] == 0:
            push = max(push, -lam[K.normal[c]])
            pull = max(pull, lam[K.normal[c]])
    if pull > ROUND_OFF_RTOL * push:
        return True
    for f in range(K.n_frictions):
        if K.sticks[f] == 1 and friction_size(K, f, lam) > (1.0 - ROUND_OFF_RTOL) * K.limit[f]:
            return True
    return False


def freed(K: Complementarity, row: int, spans: int) -> float:
    """What the freedoms with the amounts K.disc_y bring to the multiplier of a row."""
    value = 0.0
    for j in range(spans):
        value += K.freedom[row * K.n_disc_unknowns + j] * K.disc_y[j]
    return value


def limits_row(K: ContactRows, row: int) -> bool:
    """Whether a friction limits the multiplier of a row."""
    f = K.row_friction[row]
    return bool(f >= 0 and K.sticks[f] == 1)


def find_freedoms(K: Balance, pushes_stay: bool) -> int:
    """An orthonormal basis of Z into the columns of K.freedom; how many: those that change a friction that sticks.

    With `pushes_stay` (a friction slides, which follows them) only those that change no push.
    """
    count = find_null_vectors(K)
    if count == 0:
        return 0
    width = K.n_rows
    found = 0
    first = 0
    for turn in range(2):
        if turn == 0 and not pushes_stay:
            continue
        for row in range(K.n_rows):
            c = K.row_contact[row]
            wanted = (c >= 0 and K.normal[c] == row) if turn == 0 else limits_row(K, row)
            if not wanted or found >= count:
                continue
            o = found * width
            for d in range(count):  # the line of this row in the basis of null vectors
                K.null_way[o + d] = K.null_vectors[d * width + row]
            size = sqrt(square(K.null_way, o, count))
            for _ in range(2):
                for i in range(found):
                    clear_row(K.null_way, o, i * width, count)
            left = sqrt(square(K.null_way, o, count))
            if size > HALF_PRECISION_RTOL and left > HALF_PRECISION_RTOL * max(size, 1.0):
                for d in range(count):
                    K.null_way[o + d] /= left
                found += 1
        if turn == 0:
            first = found
    largest = largest_limit(K)
    for row in range(K.n_rows):
        weight = sqrt(share(K, row, largest))
        for j in range(first, found):
            value = 0.0
            for d in range(count):
                value += K.null_way[j * width + d] * K.null_vectors[d * width + row]
            K.freedom[row * K.n_disc_unknowns + j - first] = weight * value
    return found - first


def find_null_vectors(K: Balance) -> int:
    """All Z of K.dependence, orthonormal in the metric W⁻¹, line by line into K.null_vectors; how many."""
    largest = largest_limit(K)
    count = 0
    for d in range(K.n_rows):
        if K.dropped[d] == 0:
            continue
        o = count * K.n_rows
        for row in range(K.n_rows):
            value = -K.dependence[d * K.n_rows + row] if K.dropped[row] == 0 else 0.0
            K.null_vectors[o + row] = (1.0 if row == d else value) / sqrt(share(K, row, largest))
        size = sqrt(square(K.null_vectors, o, K.n_rows))
        for _ in range(2):
            for i in range(count):
                clear_row(K.null_vectors, o, i * K.n_rows, K.n_rows)
        left = sqrt(square(K.null_vectors, o, K.n_rows))
        if left > HALF_PRECISION_RTOL * size:
            for row in range(K.n_rows):
                K.null_vectors[o + row] /= left
            count += 1
    return count


def is_free(K: Complementarity, row: int, spans: int) -> bool:
    """Whether the freedoms change the multiplier of a row."""
    size = 0.0
    for j in range(spans):
        size = max(size, abs(K.freedom[row * K.n_disc_unknowns + j]))
    return size > HALF_PRECISION_RTOL


def find_discs(K: ContactForces, lam: Reals, spans: int, scale: float) -> int:
    """The cones that the freedoms change, as discs in parts of `scale`; how many."""
    find_rises(K, lam, spans)
    discs = 0
    for f in range(K.n_frictions):
        if K.sticks[f] == 0 or follows(K, f):
            continue
        c = K.friction_contact[f]
        push = K.normal[c] if c >= 0 else -1
        touched = push >= 0 and is_free(K, push, spans)
        for g in range(f, f + K.group_size[f]):
            touched = touched or is_free(K, K.friction_row[g], spans)
        if not touched:
            continue
        for k in range(DISC_SIZE - 1):
            row = K.friction_row[f + k] if k < K.group_size[f] else -1
            fill_line(K, DISC_SIZE * discs + k, row, 1.0, lam[row] / scale if row >= 0 else 0.0, spans)
        limit = max(K.limit[f] / scale, ROUND_OFF_RTOL)
        fill_line(K, DISC_SIZE * discs + 3, push, -K.rise[f], limit, spans)
        K.disc_weight[discs] = max(limit, MIN_WEIGHT_RATIO)
        discs += 1
    for c in range(K.n_contacts):
        push = K.normal[c]
        if K.kind[c] == 0 and K.opens[c] == 0 and push >= 0 and is_free(K, push, spans):
            for k in range(DISC_SIZE - 1):
                fill_line(K, DISC_SIZE * discs + k, -1, 0.0, 0.0, spans)
            fill_line(K, DISC_SIZE * discs + 3, push, -1.0, max(-lam[push] / scale, ROUND_OFF_RTOL), spans)
            K.disc_weight[discs] = 1.0
            discs += 1
    return discs


def fill_line(K: Complementarity, line: int, row: int, sign: float, value: float, spans: int) -> None:
    """One number of a disc: `value` and what the freedoms bring to the multiplier of a row (−1: nothing)."""
    for j in range(K.n_disc_unknowns):
        K.disc_map[line * K.n_disc_unknowns + j] = 0.0
    for j in range(spans):
        K.disc_map[line * K.n_disc_unknowns + j] = sign * K.freedom[row * K.n_disc_unknowns + j] if row >= 0 else 0.0
    K.disc_at[line] = value


def find_rises(K: ContactForces, lam: Reals, spans: int) -> None:
    """What a push of one more adds to each limit, into K.rise, where freedoms change pushes."""
    K.rise[: K.n_frictions] = 0.0
    coupled = False
    for c in range(K.n_contacts):
        coupled = coupled or (K.normal[c] >= 0 and is_free(K, K.normal[c], spans))
    if not coupled:
        return
    K.loads[: K.n_rows] = lam[: K.n_rows]
    evaluate_loaded(K, K.loads)
    for f in range(K.n_frictions):
        K.rise[f] = -limit_of(K, f)
    for c in range(K.n_contacts):
        if K.normal[c] >= 0:
            K.loads[K.normal[c]] -= 1.0
    evaluate_loaded(K, K.loads)
    for f in range(K.n_frictions):
        K.rise[f] += limit_of(K, f)
    evaluate_loaded(K, lam)


def find_brink(K: Complementarity, spans: int, discs: int) -> float:
    """The least σ, with its freedoms in K.disc_y."""
    width = K.n_disc_unknowns
    K.disc_y[:spans] = 0.0
    far = 0.0
    for i in range(discs):
        K.disc_map[(DISC_SIZE * i + 3) * width + spans] = K.disc_weight[i]
        far = max(far, (disc_length(K, i, spans) - K.disc_at[DISC_SIZE * i + 3]) / K.disc_weight[i])
    K.disc_y[spans] = far + 1.0
    minimize_within_discs(K, spans + 1, discs, False)
    for i in range(discs):
        K.disc_map[(DISC_SIZE * i + 3) * width + spans] = 0.0
    return float(K.disc_y[spans])
