/* Solving with the SIZE x SIZE matrix [S R; B 0], its size known to the compiler: as a whole, by LU with partial pivoting,
   or, with REDUCED, by eliminating the rows first. */

#if REDUCED
/* Row k holds coordinate GIVEN[k] with the coefficient 1 and no other coordinate of GIVEN, which a model promises. So
   x_g = c - B x_f and lambda = b_g - S_gg x_g - S_gf x_f; what is left for the coordinates FREE,
   (S_ff - S_fg B - R T) x_f = b_f - S_fg c - R (b_g - S_gg c) with T = S_gf - S_gg B, takes LU without exchanges. */
enum { LEFT = N - M };

/* T in the place of S_gf, the factors of what is left in that of S_ff; 0, or 1 + the pivot that lost its digits. */
static int factor(double A[SIZE][SIZE], int pivots[SIZE])
{
    double before[LEFT];
    (void)pivots;
    for (int i = 0; i < LEFT; i++)
        before[i] = fabs(A[FREE[i]][FREE[i]]);
    for (int k = 0; k < M; k++)
        for (int j = 0; j < LEFT; j++)
            for (int l = 0; l < M; l++)
                A[GIVEN[k]][FREE[j]] -= A[GIVEN[k]][GIVEN[l]] * A[N + l][FREE[j]];
    for (int i = 0; i < LEFT; i++)
        for (int j = 0; j < LEFT; j++)
            for (int k = 0; k < M; k++)
                A[FREE[i]][FREE[j]] -= A[FREE[i]][GIVEN[k]] * A[N + k][FREE[j]] + A[FREE[i]][N + k] * A[GIVEN[k]][FREE[j]];
    for (int k = 0; k < LEFT; k++) {
        double size = fabs(A[FREE[k]][FREE[k]]);
        if (!(size > 1e-8 * before[k] && before[k] > 1e-8 * size))
            return k + 1;
        double inverse = 1.0 / A[FREE[k]][FREE[k]];
        A[FREE[k]][FREE[k]] = inverse;
        for (int i = k + 1; i < LEFT; i++) {
            double left = A[FREE[i]][FREE[k]] * inverse;
            A[FREE[i]][FREE[k]] = left;
            for (int j = k + 1; j < LEFT; j++)
                A[FREE[i]][FREE[j]] -= left * A[FREE[k]][FREE[j]];
        }
    }
    return 0;
}

/* b <- [S R; B 0]^-1 b with what `factor` left. */
static void solve(double A[SIZE][SIZE], const int pivots[SIZE], double b[SIZE])
{
    double lam[M], x[LEFT];
    (void)pivots;
    for (int k = 0; k < M; k++) {
        lam[k] = b[GIVEN[k]];
        for (int l = 0; l < M; l++)
            lam[k] -= A[GIVEN[k]][GIVEN[l]] * b[N + l];
    }
    for (int i = 0; i < LEFT; i++) {
        x[i] = b[FREE[i]];
        for (int k = 0; k < M; k++)
            x[i] -= A[FREE[i]][GIVEN[k]] * b[N + k] + A[FREE[i]][N + k] * lam[k];
        for (int j = 0; j < i; j++)
            x[i] -= A[FREE[i]][FREE[j]] * x[j];
    }
    for (int k = LEFT - 1; k >= 0; k--) {
        x[k] *= A[FREE[k]][FREE[k]];
        for (int i = 0; i < k; i++)
            x[i] -= A[FREE[i]][FREE[k]] * x[k];
    }
    for (int k = 0; k < M; k++) {
        b[GIVEN[k]] = b[N + k];
        for (int j = 0; j < LEFT; j++) {
            b[GIVEN[k]] -= A[N + k][FREE[j]] * x[j];
            lam[k] -= A[GIVEN[k]][FREE[j]] * x[j];
        }
    }
    for (int j = 0; j < LEFT; j++)
        b[FREE[j]] = x[j];
    for (int k = 0; k < M; k++)
        b[N + k] = lam[k];
}
#else
/* Factors in place, with inverse pivots on the diagonal; 0, or 1 + the column without a pivot. */
static int factor(double A[SIZE][SIZE], int pivots[SIZE])
{
    for (int k = 0; k < SIZE; k++) {
        int p = k;
        double big = fabs(A[k][k]);
        for (int i = k + 1; i < SIZE; i++)
            if (fabs(A[i][k]) > big) {
                big = fabs(A[i][k]);
                p = i;
            }
        pivots[k] = p;
        if (!(big > 1e-300 && big < 1e300))
            return k + 1;
        if (p != k)
            for (int j = 0; j < SIZE; j++) {
                double swap = A[k][j];
                A[k][j] = A[p][j];
                A[p][j] = swap;
            }
        double inverse = 1.0 / A[k][k];
        A[k][k] = inverse;
        for (int i = k + 1; i < SIZE; i++)
            if (A[i][k] != 0.0) {
                double left = A[i][k] * inverse;
                A[i][k] = left;
                for (int j = k + 1; j < SIZE; j++)
                    A[i][j] -= left * A[k][j];
            }
    }
    return 0;
}

/* b <- A^-1 b with the factors of `factor`. */
static void solve(double A[SIZE][SIZE], const int pivots[SIZE], double b[SIZE])
{
    for (int k = 0; k < SIZE; k++) {
        double swap = b[k];
        b[k] = b[pivots[k]];
        b[pivots[k]] = swap;
    }
    for (int i = 1; i < SIZE; i++) {
        double total = b[i];
        for (int j = 0; j < i; j++)
            total -= A[i][j] * b[j];
        b[i] = total;
    }
    for (int k = SIZE - 1; k >= 0; k--) {
        b[k] *= A[k][k];
        for (int i = 0; i < k; i++)
            b[i] -= A[i][k] * b[k];
    }
}
#endif
