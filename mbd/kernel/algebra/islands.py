"""Islands: coordinates and rows that nothing couples to others, the connected components of [M R; B 0].

Each is a problem of its own: n bodies that do not touch each other are n small ones. What couples is an entry other
than 0.0; where one vanishes at an instant both orders of solving are the same.
"""

from mbd.kernel.algebra.redundancy import shared
from mbd.kernel.records import DependentRows, LinearAlgebra
from mbd.kernel.tangent_rules import takes_part


def saddle_entry(K: DependentRows, u: int, v: int, together: bool) -> float:
    """Entry (u, v) of [M R; B 0], the rows in K.rows behind the coordinates, with shares of dependent rows in R."""
    n = K.n
    if u >= n:
        return float(K.acc[K.acc_B + K.rows[u - n] * n + v]) if v < n else 0.0
    if v < n:
        return float(K.acc[u * n + v])
    row = K.rows[v - n]
    return float(K.acc[K.acc_R + u * K.n_rows + row] + (shared(K, u, row) if together else 0.0))


def couples(K: DependentRows, u: int, v: int) -> bool:
    """Whether [M R; B 0] has an entry other than 0 between two unknowns."""
    return takes_part(saddle_entry(K, u, v, False)) or takes_part(saddle_entry(K, v, u, False))


def find_islands(K: DependentRows, m: int) -> int:
    """Numbers of the islands of coordinates and of the m rows in K.rows, into K.island; how many islands there are.

    Once every unknown has its island, which in one mechanism takes a few rows, nothing else is looked at.
    """
    size = K.n + m
    count = 0
    left = size
    for u in range(size):
        K.island[u] = -1
    for first in range(size):
        if K.island[first] >= 0:
            continue
        K.island[first] = count
        K.members[0] = first
        left -= 1
        waiting = 1
        while waiting > 0 and left > 0:
            waiting -= 1
            u = K.members[waiting]
            for v in range(size):
                if K.island[v] < 0 and couples(K, u, v):
                    K.island[v] = count
                    left -= 1
                    K.members[waiting] = v
                    waiting += 1
        count += 1
    return count


def gather_island(K: LinearAlgebra, m: int, island: int) -> int:
    """Unknowns of an island into K.members, ascending; how many."""
    count = 0
    for u in range(K.n + m):
        if K.island[u] == island:
            K.members[count] = u
            count += 1
    return count
