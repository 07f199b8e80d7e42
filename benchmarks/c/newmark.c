/* Generalized-alpha with constraint rows, written by hand for one model: the yardstick of mbd/kernel/newmark.py.

       cc -O3 -march=native -shared -fPIC -DMODEL='"compass.h"' -DSTABILIZED=0 -DREDUCED=0 newmark.c -lm

   The same scheme, predictor, tolerances, Newton policy (tangent first, then residuals; a new tangent where these stall)
   and pivoted LU, or with REDUCED elimination of the rows as in mbd/tape/elimination.py. Simpler, as a person would have it: sizes, model and formulation are known to the compiler, all steps
   have one length, there are no contacts. A model gives N, M, ANGLES (which coordinates are angles, as bits),
   ANGLE_ROWS, GIVEN and FREE (which coordinates the rows give), tangent, residual, row_bias and magnitudes. */

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

typedef struct {
    double r[N], h[M], rate[M];
} Residual;

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
static double residual_size(const Motion *s, const Point *at, const Residual *e, double C, double K, double tolerance)
{
    const double *r = e->r, *h = e->h, *rate = e->rate;
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

/* Step-wide numbers: c_C = C, c_K = K, and what the average of the scheme weighs. */
typedef struct {
    double C, K, mean_f, mean_m;
} Factors;

static inline Factors factors_of(const Scheme *c)
{
    double mean_f = 1.0 - c->alpha_f, mean_m = 1.0 - c->alpha_m, h = c->dt;
    return (Factors){c->gamma * h * mean_f / mean_m, c->beta * h * h * mean_f / mean_m, mean_f, mean_m};
}

/* Accelerations, multipliers and position correction extrapolated. */
static void predict(const Scheme *c, const Factors *f, const Motion *s, Point *at, double shift[N])
{
    const double h = c->dt;
    for (int k = 0; k < M; k++)
        at->lam[k] = s->now.lam[k] + h * s->lam_slope[k];
    for (int i = 0; i < N; i++) {
        double a0 = s->aux[i];
        at->a[i] = s->now.a[i] + h * s->slope[i];
        double a1 = (f->mean_f * at->a[i] + c->alpha_f * s->now.a[i] - c->alpha_m * a0) / f->mean_m;
        at->v[i] = s->now.v[i] + h * ((1.0 - c->gamma) * a0 + c->gamma * a1);
        at->q[i] = s->now.q[i] + h * s->now.v[i] + h * h * ((0.5 - c->beta) * a0 + c->beta * a1);
        if (STABILIZED) {
            shift[i] = s->shift[i] + s->shift_change[i];
            at->q[i] += shift[i];
        }
    }
}

/* b for accelerations and multipliers, d for the whole position correction (with old factors: for its change).
   Returns whether positions need correcting: at round-off they stay, correcting would only stir the velocity rows. */
static int right_hand_sides(const Factors *f, const Motion *s, const Residual *e, double A[SIZE][SIZE], int renewed,
                            const double shift[N], double b[SIZE], double d[SIZE], double turning[M][N])
{
    int shifting = 0;
    for (int i = 0; i < N; i++) {
        b[i] = -e->r[i];
        d[i] = 0.0;
    }
    for (int k = 0; k < M; k++) {
        b[N + k] = STABILIZED ? -e->rate[k] / f->C : -e->h[k] / f->K;
        if (STABILIZED) {
            shifting |= fabs(e->h[k]) > 16.0 * EPS * s->scale_h[k];
            d[N + k] = f->K / f->C * e->rate[k] - e->h[k];
            for (int j = 0; j < N && renewed; j++) {
                d[N + k] += A[N + k][j] * shift[j];
                turning[k][j] = (A[N + k][j] - A[j][N + k]) / f->K; /* d(rate)/dq / C, as B~ = B + K/C d(rate)/dq */
            }
        }
    }
    return shifting;
}

/* Apply a correction; its size relative to the largest acceleration. */
static double correct(const Factors *f, const double b[SIZE], const double d[SIZE], int shifting, int renewed, Point *at,
                      double shift[N])
{
    double biggest = 0.0, fastest = 1e-300;
    for (int i = 0; i < N; i++) {
        biggest = larger(biggest, fabs(b[i]));
        fastest = larger(fastest, fabs(at->a[i]));
        at->a[i] += b[i];
        at->v[i] += f->C * b[i];
        at->q[i] += f->K * b[i];
        if (shifting) {
            double next = renewed ? d[i] : shift[i] + d[i];
            at->q[i] += next - shift[i];
            shift[i] = next;
        }
    }
    for (int k = 0; k < M; k++)
        at->lam[k] += b[N + k];
    return biggest / fastest;
}

/* The converged point becomes the state. */
static void finish(const Scheme *c, const Factors *f, const Point *at, const double shift[N], Motion *s)
{
    for (int i = 0; i < N; i++) {
        s->aux[i] = (f->mean_f * at->a[i] + c->alpha_f * s->now.a[i] - c->alpha_m * s->aux[i]) / f->mean_m;
        s->slope[i] = (at->a[i] - s->now.a[i]) / c->dt;
        if (STABILIZED) {
            s->shift_change[i] = shift[i] - s->shift[i];
            s->shift[i] = shift[i];
        }
    }
    for (int k = 0; k < M; k++)
        s->lam_slope[k] = (at->lam[k] - s->now.lam[k]) / c->dt;
    s->now = *at;
}

/* One step: a tangent, then residuals with its factors; a new tangent where the residual falls too slowly. */
static int step(const Model *p, const Scheme *c, Motion *s, int64_t counts[3])
{
    const Factors f = factors_of(c);
    double A[SIZE][SIZE], turning[M][N], b[SIZE], d[SIZE], shift[N], tolerance = 1e-3 * c->tolerance, before = 1e300;
    int pivots[SIZE], fresh = 0;
    Point at;
    Residual e;

    predict(c, &f, s, &at, shift);
    for (int iteration = 0; iteration < MAX_ITERATIONS; iteration++) {
        int renew = !fresh;
        if (renew)
            tangent(p, &at, f.C, f.K, STABILIZED ? f.K / f.C : 0.0, A, e.r, e.h, e.rate);
        else
            residual(p, &at, e.r, e.h, e.rate);
        counts[renew ? TANGENTS : RESIDUALS]++;
        double error = residual_size(s, &at, &e, f.C, f.K, tolerance);
        if (error < 0.0)
            return 1;
        if (error > 1.0 && iteration >= 2 && error > 0.5 * before) { /* stalled: new scales, then round-off decide */
            raise_scales(p, &at, s, 1);
            error = residual_size(s, &at, &e, f.C, f.K, tolerance);
            if (residual_size(s, &at, &e, 0.0, 0.0, 256.0 * EPS) <= 16.0)
                error = smaller(error, 1.0);
        }
        if (error <= 1.0) {
            finish(c, &f, &at, shift, s);
            return 0;
        }
        if (!renew && error > 0.3 * before) { /* the old tangent has done its work: renew it at the same iterate */
            fresh = 0;
            before = 1e300;
            continue;
        }
        before = error;
        int shifting = right_hand_sides(&f, s, &e, A, renew, shift, b, d, turning);
        if (renew && factor(A, pivots))
            return 1;
        if (shifting) { /* positions first: what that changes of the rates, the accelerations make good */
            solve(A, pivots, d);
            for (int k = 0; k < M; k++)
                for (int j = 0; j < N; j++)
                    b[N + k] -= turning[k][j] * (renew ? d[j] - shift[j] : d[j]);
        }
        solve(A, pivots, b);
        counts[ITERATIONS]++;
        double biggest = correct(&f, b, d, shifting, renew, &at, shift);
        if (iteration == 0) /* stay far below the error of the step, which the predictor's error measures */
            tolerance = smaller(c->tolerance, larger(1e-4 * biggest, tolerance));
        fresh = 1;
    }
    return 1;
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
