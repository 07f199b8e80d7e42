"""Where the numbers of a step of several stages lie in K.stages."""

from mbd.kernel.records import Settings

# where the numbers of the method lie in K.stages (see `mbd.kernel.schemes.collocation`)
C_, A_, A2_, MU_REAL, MU_RE, MU_IM, T_REAL, S_REAL, T_RE, T_IM, S_RE, S_IM, E_, INVERSE_, N_NUMBERS = (
    0, 3, 12, 21, 22, 23, 24, 27, 30, 33, 36, 39, 42, 45, 54,
)  # fmt: skip
# parts of K.stages behind them
(
    STAGE_RATES, STAGE_LAM, STAGE_SHIFT, CHANGES, BALANCES, HEIGHTS, HELD, MASS_PART, STIFF_PART, PAIR, PAIR_PIVOTS,
    PAIR_RHS, STAGE_BEND, STAGES_END,
) = range(14)  # fmt: skip


def stage_place(K: Settings, part: int) -> int:
    """Where a part of K.stages begins.

    W (3, n) | λ (3, rows) | U (3, n_v) | last changes of W and λ | r and ḣ of each stage | h | H U | M | c² K |
    complex matrix | its pivots | its right-hand side | E (3, n_v) where positions do not add
    """
    size = K.n + K.n_rows
    place = N_NUMBERS
    if part > STAGE_RATES:
        place += 3 * K.n
    if part > STAGE_LAM:
        place += 3 * K.n_rows
    if part > STAGE_SHIFT:
        place += 3 * K.n_v
    if part > CHANGES:
        place += 3 * size
    if part > BALANCES:
        place += 3 * size
    if part > HEIGHTS:
        place += 3 * K.n_rows
    if part > HELD:
        place += 3 * K.n_rows
    if part > MASS_PART:
        place += K.n * K.n
    if part > STIFF_PART:
        place += K.n * K.n
    if part > PAIR:
        place += 2 * size * size
    if part > PAIR_PIVOTS:
        place += size
    if part > PAIR_RHS:
        place += 2 * size
    if part > STAGE_BEND and K.vector == 0:
        place += 3 * K.n_v
    return int(place)
