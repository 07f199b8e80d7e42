/* Compass walker, by hand: a hip mass carries two equal legs with point masses; the foot of leg 1 stays where it is.

   Coordinates (x, y, th1, th2): the hip's place and the angles of the legs from -y, right-handed about z.
   A leg's mass is at (x + c sin th, y - c cos th), its foot at (x + L sin th, y - L cos th).
   Rows: h0 = y - L cos th1, h1 = x + L sin th1.  r = M a + f + B' lam. */

enum { N = 4, M = 2, ANGLES = 0xC, ANGLE_ROWS = 0 };
#include "point.h"

/* coordinates that the rows give, in the order of the rows, and the others */
static const int GIVEN[M] = {1, 0}, FREE[N - M] = {2, 3};

typedef struct {
    double hip, leg, length, center, gx, gy; /* masses [kg], lengths [m], gravity [m/s^2] */
} Model;

static void residual(const Model *p, const Point *s, double r[N], double h[M], double rate[M])
{
    double s1 = sin(s->q[2]), c1 = cos(s->q[2]), s2 = sin(s->q[3]), c2 = cos(s->q[3]);
    double mass = p->hip + 2.0 * p->leg, mc = p->leg * p->center, L = p->length, w1 = s->v[2], w2 = s->v[3];
    double ax = s->a[0] - p->gx, ay = s->a[1] - p->gy, a1 = s->a[2], a2 = s->a[3];
    r[0] = mass * ax + mc * (c1 * a1 - s1 * w1 * w1 + c2 * a2 - s2 * w2 * w2) + s->lam[1];
    r[1] = mass * ay + mc * (s1 * a1 + c1 * w1 * w1 + s2 * a2 + c2 * w2 * w2) + s->lam[0];
    r[2] = mc * (c1 * ax + s1 * ay + p->center * a1) + L * (s1 * s->lam[0] + c1 * s->lam[1]);
    r[3] = mc * (c2 * ax + s2 * ay + p->center * a2);
    h[0] = s->q[1] - L * c1;
    h[1] = s->q[0] + L * s1;
    rate[0] = s->v[1] + L * s1 * w1;
    rate[1] = s->v[0] + L * c1 * w1;
}

/* [S  B'; B~  0] with S = dr/da + C dr/dv + K dr/dq and B~ = B + G d(rate)/dq, beside the residual. */
static void tangent(const Model *p, const Point *s, double C, double K, double G, double A[SIZE][SIZE], double r[N],
                    double h[M], double rate[M])
{
    double s1 = sin(s->q[2]), c1 = cos(s->q[2]), s2 = sin(s->q[3]), c2 = cos(s->q[3]);
    double mass = p->hip + 2.0 * p->leg, mc = p->leg * p->center, L = p->length, w1 = s->v[2], w2 = s->v[3];
    double ax = s->a[0] - p->gx, ay = s->a[1] - p->gy, a1 = s->a[2], a2 = s->a[3];
    double along1 = c1 * ax + s1 * ay, along2 = c2 * ax + s2 * ay, pull1 = s1 * s->lam[0] + c1 * s->lam[1];
    r[0] = mass * ax + mc * (c1 * a1 - s1 * w1 * w1 + c2 * a2 - s2 * w2 * w2) + s->lam[1];
    r[1] = mass * ay + mc * (s1 * a1 + c1 * w1 * w1 + s2 * a2 + c2 * w2 * w2) + s->lam[0];
    r[2] = mc * (along1 + p->center * a1) + L * pull1;
    r[3] = mc * (along2 + p->center * a2);
    h[0] = s->q[1] - L * c1;
    h[1] = s->q[0] + L * s1;
    rate[0] = s->v[1] + L * s1 * w1;
    rate[1] = s->v[0] + L * c1 * w1;

    double near1 = 1.0 - K * w1 * w1, side1 = K * a1 + 2.0 * C * w1;
    double near2 = 1.0 - K * w2 * w2, side2 = K * a2 + 2.0 * C * w2;
    memset(A, 0, sizeof(double) * SIZE * SIZE);
    A[0][0] = A[1][1] = mass;
    A[0][2] = mc * (c1 * near1 - s1 * side1);
    A[0][3] = mc * (c2 * near2 - s2 * side2);
    A[1][2] = mc * (s1 * near1 + c1 * side1);
    A[1][3] = mc * (s2 * near2 + c2 * side2);
    A[2][0] = mc * c1;
    A[2][1] = mc * s1;
    A[2][2] = mc * p->center + K * (mc * (c1 * ay - s1 * ax) + L * (c1 * s->lam[0] - s1 * s->lam[1]));
    A[3][0] = mc * c2;
    A[3][1] = mc * s2;
    A[3][3] = mc * p->center + K * mc * (c2 * ay - s2 * ax);
    A[0][5] = A[1][4] = A[4][1] = A[5][0] = 1.0;
    A[2][4] = L * s1;
    A[2][5] = L * c1;
    A[4][2] = L * (s1 + G * c1 * w1);
    A[5][2] = L * (c1 - G * s1 * w1);
}

/* d/dt(B) v, the part of the second derivatives of the rows without accelerations. */
static void row_bias(const Model *p, const Point *s, double bias[M])
{
    double along = p->length * s->v[2] * s->v[2];
    bias[0] = along * cos(s->q[2]);
    bias[1] = -along * sin(s->q[2]);
}

/* Sizes of r, of the rows and of their rates, term by term before cancellation. */
static void magnitudes(const Model *p, const Point *s, double r[N], double h[M], double rate[M])
{
    double s1 = fabs(sin(s->q[2])), c1 = fabs(cos(s->q[2])), s2 = fabs(sin(s->q[3])), c2 = fabs(cos(s->q[3]));
    double mass = p->hip + 2.0 * p->leg, mc = p->leg * p->center, L = p->length;
    double w1 = fabs(s->v[2]), w2 = fabs(s->v[3]), a1 = fabs(s->a[2]), a2 = fabs(s->a[3]);
    double ax = fabs(s->a[0]) + fabs(p->gx), ay = fabs(s->a[1]) + fabs(p->gy);
    double l0 = fabs(s->lam[0]), l1 = fabs(s->lam[1]);
    r[0] = mass * ax + mc * (c1 * a1 + s1 * w1 * w1 + c2 * a2 + s2 * w2 * w2) + l1;
    r[1] = mass * ay + mc * (s1 * a1 + c1 * w1 * w1 + s2 * a2 + c2 * w2 * w2) + l0;
    r[2] = mc * (c1 * ax + s1 * ay + p->center * a1) + L * (s1 * l0 + c1 * l1);
    r[3] = mc * (c2 * ax + s2 * ay + p->center * a2);
    h[0] = fabs(s->q[1]) + L * c1;
    h[1] = fabs(s->q[0]) + L * s1;
    rate[0] = fabs(s->v[1]) + L * s1 * w1;
    rate[1] = fabs(s->v[0]) + L * c1 * w1;
}
