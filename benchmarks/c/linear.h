/* LU with partial pivoting of a row-major SIZE x SIZE matrix whose size is known to the compiler. */

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
