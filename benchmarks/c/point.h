/* Where the equations are evaluated: coordinates, velocities, accelerations, multipliers. */

enum { SIZE = N + M };

typedef struct {
    double q[N], v[N], a[N], lam[M];
} Point;
