/* Generalized-alpha with constraint rows, written by hand for one model: the yardstick of mbd/kernel/newmark.py.

       cc -O3 -march=native -shared -fPIC -DMODEL='"compass.h"' -DSTABILIZED=0 newmark.c -lm

   The same scheme, predictor, tolerances, Newton policy (tangent first, then residuals; a new tangent where these stall)
   and pivoted LU. Simpler, as a person would have it: sizes, model and formulation are known to the compiler, all steps
   have one length, there are no contacts. A model gives N, M, ANGLES (which coordinates are angles, as bits),
   ANGLE_ROWS, tangent, residual, row_bias and magnitudes. */

#include <math.h>
#include <stdint.h>
#include <string.h>

static inline double larger(double a, double b) { return b > a ? b : a; } /* one instruction, which fmax is not */
static inline double smaller(double a, double b) { return b < a ? b : a; }

#include MODEL
#include "linear.h"

enum { TANGENTS, RESIDUALS, ITERATIONS, MAX_ITERATIONS = 25 };
static const double EPS = 2.220446049250313e-16;

typedef struct {
    double alpha_m, alpha_f, beta, gamma, tolerance, dt;
} Scheme;

typedef struct {
    Point now;
    double aux[N], slope[N], lam_slope[M], shift[N], shift_change[N]; /* memory of the scheme */
    double scale_r[N], scale_h[M], scale_rate[M];
} Motion;

static void refresh_scales(const Model *p, const Point *at, Motion *s)
{
    double force = 1e-280, torque = 1e-280, size[2] = {1e-3, 1e-3}, speed[2] = {1e-3, 1e-3};
    magnitudes(p, at, s->scale_r, s->scale_h, s->scale_rate);
    for (int i = 0; i < N; i++) {
        int angle = ANGLES >> i & 1;
        if (angle)
            torque = larger(torque, s->scale_r[i]);
        else
            force = larger(force, s->scale_r[i]);
        size[angle] = larger(size[angle], fabs(at->q[i]));
        speed[angle] = larger(speed[angle], fabs(at->v[i]));
    }
    for (int i = 0; i < N; i++)
        s->scale_r[i] = ANGLES >> i & 1 ? torque : force;
    for (int k = 0; k < M; k++) {
        s->scale_h[k] = larger(s->scale_h[k], size[ANGLE_ROWS >> k & 1]);
        s->scale_rate[k] = larger(s->scale_rate[k], speed[ANGLE_ROWS >> k & 1]);
    }
}

/* The same where they exceed those known, those of rows on demand; a force that passes zero has none. */
static void raise_scales(const Model *p, const Point *at, Motion *s, int rows)
{
    Motion old = *s;
    refresh_scales(p, at, s);
    for (int i = 0; i < N; i++)
        s->scale_r[i] = larger(s->scale_r[i], old.scale_r[i]);
    for (int k = 0; k < M && rows; k++) {
        s->scale_h[k] = larger(s->scale_h[k], old.scale_h[k]);
        s->scale_rate[k] = larger(s->scale_rate[k], old.scale_rate[k]);
    }
}

/* Accelerations and multipliers that satisfy the balance and the rows at acceleration level. */
static int consistent(const Model *p, Point *at)
{
    double A[SIZE][SIZE], b[SIZE], h[M], rate[M];
    int pivots[SIZE];
    memset(at->a, 0, sizeof at->a);
    memset(at->lam, 0, sizeof at->lam);
    tangent(p, at, 0.0, 0.0, 0.0, A, b, h, rate);
    row_bias(p, at, b + N);
    if (factor(A, pivots))
        return 1;
    solve(A, pivots, b);
    for (int i = 0; i < N; i++)
        at->a[i] = -b[i];
    for (int k = 0; k < M; k++)
        at->lam[k] = -b[N + k];
    return 0;
}

/* Memory at a consistent state: a0 = a + (alpha_m - alpha_f) dt jerk, the jerk from one difference. */
static int start(const Model *p, const Scheme *c, Motion *s)
{
    double step = c->dt / 16.0;
    memset(s->shift, 0, sizeof s->shift);
    memset(s->shift_change, 0, sizeof s->shift_change);
    if (consistent(p, &s->now))
        return 1;
    Point later = s->now;
    for (int i = 0; i < N; i++) {
        later.q[i] += step * s->now.v[i];
        later.v[i] += step * s->now.a[i];
    }
    if (consistent(p, &later))
        return 1;
    for (int i = 0; i < N; i++) {
        s->slope[i] = (later.a[i] - s->now.a[i]) / step;
        s->aux[i] = s->now.a[i] + (c->alpha_m - c->alpha_f) * c->dt * s->slope[i];
    }
    for (int k = 0; k < M; k++)
        s->lam_slope[k] = (later.lam[k] - s->now.lam[k]) / step;
    refresh_scales(p, &s->now, s);
    later = s->now;
    for (int i = 0; i < N; i++) { /* sizes a step later count as well */
        later.q[i] += c->dt * (s->now.v[i] + 0.5 * c->dt * s->now.a[i]);
        later.v[i] += c->dt * s->now.a[i];
        later.a[i] += c->dt * s->slope[i];
    }
    raise_scales(p, &later, s, 0);
    return 0;
}

/* Largest residual over its tolerance, each block apart; -1 if not finite. */
static double residual_size(const Motion *s, const Point *at, const double r[N], const double h[M], const double rate[M],
                            double C, double K, double tolerance)
{
    double size = 0.0, finite = 0.0, fastest = 0.0, speed = 0.0;
    for (int i = 0; i < N; i++) {
        finite += fabs(r[i]);
        size = larger(size, fabs(r[i]) / (tolerance * s->scale_r[i]));
        fastest = larger(fastest, fabs(at->a[i]));
        speed = larger(speed, fabs(at->v[i]));
    }
    for (int k = 0; k < M; k++) {
        double limit = STABILIZED ? tolerance * C * speed : tolerance * K * fastest;
        finite += fabs(h[k]);
        size = larger(size, fabs(h[k]) / (larger(16.0 * EPS * s->scale_h[k], limit) + 1e-300));
        if (STABILIZED) {
            finite += fabs(rate[k]);
            size = larger(size, fabs(rate[k]) / (larger(16.0 * EPS * s->scale_rate[k], tolerance * C * fastest) + 1e-300));
        }
    }
    return finite < 1e300 ? size : -1.0;
}

static int step(const Model *p, const Scheme *c, Motion *s, int64_t counts[3])
{
    const double h1 = c->dt, mean_f = 1.0 - c->alpha_f, mean_m = 1.0 - c->alpha_m;
    const double C = c->gamma * h1 * mean_f / mean_m, K = c->beta * h1 * h1 * mean_f / mean_m;
    double A[SIZE][SIZE], rows[M][N], r[N], h[M], rate[M], b[SIZE], d[SIZE], shift[N];
    double tolerance = 1e-3 * c->tolerance, before = 1e300, error;
    int pivots[SIZE], fresh = 0, accepted = 0;
    Point at;

    for (int k = 0; k < M; k++)
        at.lam[k] = s->now.lam[k] + h1 * s->lam_slope[k];
    for (int i = 0; i < N; i++) {
        double a0 = s->aux[i];
        at.a[i] = s->now.a[i] + h1 * s->slope[i];
        double a1 = (mean_f * at.a[i] + c->alpha_f * s->now.a[i] - c->alpha_m * a0) / mean_m;
        at.v[i] = s->now.v[i] + h1 * ((1.0 - c->gamma) * a0 + c->gamma * a1);
        at.q[i] = s->now.q[i] + h1 * s->now.v[i] + h1 * h1 * ((0.5 - c->beta) * a0 + c->beta * a1);
        if (STABILIZED) {
            shift[i] = s->shift[i] + s->shift_change[i];
            at.q[i] += shift[i];
        }
    }
    for (int iteration = 0; iteration < MAX_ITERATIONS; iteration++) {
        int renew = iteration == 0 || !fresh;
        if (renew)
            tangent(p, &at, C, K, STABILIZED ? K / C : 0.0, A, r, h, rate);
        else
            residual(p, &at, r, h, rate);
        counts[renew ? TANGENTS : RESIDUALS]++;
        error = residual_size(s, &at, r, h, rate, C, K, tolerance);
        if (error < 0.0)
            return 1;
        accepted = error <= 1.0;
        if (!accepted && iteration >= 2 && error > 0.5 * before) { /* stalled: fresh scales, then round-off decide */
            raise_scales(p, &at, s, 1);
            error = residual_size(s, &at, r, h, rate, C, K, tolerance);
            accepted = error <= 1.0 || residual_size(s, &at, r, h, rate, 0.0, 0.0, 256.0 * EPS) <= 16.0;
        }
        if (accepted)
            break;
        if (!renew && error > 0.3 * before) { /* the old tangent has done its work: renew it at the same iterate */
            fresh = 0;
            before = 1e300;
            continue;
        }
        before = error;
        for (int i = 0; i < N; i++)
            b[i] = -r[i];
        for (int k = 0; k < M; k++)
            b[N + k] = STABILIZED ? -rate[k] / C : -h[k] / K;
        if (renew) {
            if (STABILIZED)
                for (int k = 0; k < M; k++)
                    memcpy(rows[k], A[N + k], sizeof rows[k]);
            if (factor(A, pivots))
                return 1;
        }
        int shifting = 0; /* a position at round-off stays: correcting it would only stir the velocity rows */
        if (STABILIZED) { /* position correction in the metric of the same matrix */
            memset(d, 0, sizeof d);
            for (int k = 0; k < M; k++) {
                shifting |= fabs(h[k]) > 16.0 * EPS * s->scale_h[k];
                d[N + k] = K / C * rate[k] - h[k];
                if (renew)
                    for (int j = 0; j < N; j++)
                        d[N + k] += rows[k][j] * shift[j];
            }
            if (shifting)
                solve(A, pivots, d);
        }
        solve(A, pivots, b);
        counts[ITERATIONS]++;
        if (iteration == 0) { /* stay far below the error of the step, which the predictor's error measures */
            double biggest = 0.0, fastest = 1e-300;
            for (int i = 0; i < N; i++) {
                biggest = larger(biggest, fabs(b[i]));
                fastest = larger(fastest, fabs(at.a[i]));
            }
            tolerance = smaller(c->tolerance, larger(1e-4 * biggest / fastest, tolerance));
        }
        for (int i = 0; i < N; i++) {
            at.a[i] += b[i];
            at.v[i] += C * b[i];
            at.q[i] += K * b[i];
            if (shifting) {
                double next = renew ? d[i] : shift[i] + d[i];
                at.q[i] += next - shift[i];
                shift[i] = next;
            }
        }
        for (int k = 0; k < M; k++)
            at.lam[k] += b[N + k];
        fresh = 1;
    }
    if (!accepted)
        return 1;
    for (int i = 0; i < N; i++) {
        s->aux[i] = (mean_f * at.a[i] + c->alpha_f * s->now.a[i] - c->alpha_m * s->aux[i]) / mean_m;
        s->slope[i] = (at.a[i] - s->now.a[i]) / h1;
        if (STABILIZED) {
            s->shift_change[i] = shift[i] - s->shift[i];
            s->shift[i] = shift[i];
        }
    }
    for (int k = 0; k < M; k++)
        s->lam_slope[k] = (at.lam[k] - s->now.lam[k]) / h1;
    s->now = at;
    return 0;
}

/* Many steps from q, v, with a row (q, v, a, lam) stored every `stride` of them, the start first.
   Returns 0, or the number of the step that failed (-1: the start). */
int64_t run(const Model *p, const Scheme *scheme, const double *q, const double *v, int64_t steps, int64_t stride,
            double *store, int64_t counts[3])
{
    Motion s;
    memcpy(s.now.q, q, sizeof s.now.q);
    memcpy(s.now.v, v, sizeof s.now.v);
    if (start(p, scheme, &s))
        return -1;
    memcpy(store, &s.now, sizeof s.now);
    for (int64_t k = 1, since = 0; k <= steps; k++) {
        if (step(p, scheme, &s, counts))
            return k;
        if (++since < stride)
            continue;
        since = 0;
        store += sizeof s.now / sizeof *store;
        memcpy(store, &s.now, sizeof s.now);
    }
    return 0;
}
