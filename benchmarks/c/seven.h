/* Planar walker of seven links, by hand: trunk, and two legs of thigh, shank and foot; the left foot stays where it is.

   Coordinates (x, y, phi, then hip, knee, ankle of the left and of the right leg): place of the hips, angle of the
   trunk, relative angles of the joints. In the absolute angle psi of a body the equations of a planar tree are short.
   With w = R(psi) (first moment of the body and of all it carries), l = R(psi) (place of the next joint) and
   z x (a, b) = (-b, a),

       force of a body   t = alpha z x w - omega^2 w          acceleration it adds   u = alpha z x l - omega^2 l
       r_P   = m (A - g) + sum t
       r_psi = z x w . b + z x l . F + J alpha                b: A - g and the u of the inner bodies
                                                              F: the t of the outer ones

   A ground reaction lam at the ankle joins F of the bodies above it. Sums over a leg turn absolute into relative. */

enum { N = 9, M = 3, ANGLES = 0x1FC, ANGLE_ROWS = 4 };
#include "point.h"

/* coordinates that the rows give, in the order of the rows, and the others */
static const int GIVEN[M] = {0, 1, 5}, FREE[N - M] = {2, 3, 4, 6, 7, 8};

typedef struct {
    double trunk, thigh, shank, foot;                 /* masses [kg] */
    double trunk_i, thigh_i, shank_i, foot_i;         /* inertias about the centres [kg m^2] */
    double trunk_c, thigh_c, shank_c, foot_x, foot_y; /* centres [m] */
    double thigh_l, shank_l, gx, gy;                  /* lengths [m], gravity [m/s^2] */
} Model;

typedef struct {
    double x, y;
} V2;

static inline V2 add(V2 a, V2 b) { return (V2){a.x + b.x, a.y + b.y}; }
static inline V2 times(double k, V2 a) { return (V2){k * a.x, k * a.y}; }
static inline V2 turned(V2 a) { return (V2){-a.y, a.x}; }
static inline double dot(V2 a, V2 b) { return a.x * b.x + a.y * b.y; }
/* along z x a, less across a */
static inline V2 swung(V2 a, double along, double across)
{
    return (V2){-along * a.y - across * a.x, along * a.x - across * a.y};
}

typedef struct {
    V2 w[3], l[3], b[3], F[3]; /* of thigh, shank, foot */
    double omega[3], alpha[3], J[3];
    V2 t; /* sum of the forces of the leg */
} Leg;

static inline void leg_at(const Model *p, const Point *s, int first, V2 base, V2 reaction, Leg *leg)
{
    const double m[3] = {p->thigh * p->thigh_c + (p->shank + p->foot) * p->thigh_l,
                         p->shank * p->shank_c + p->foot * p->shank_l, 0.0};
    const double length[3] = {p->thigh_l, p->shank_l, 0.0};
    double psi = s->q[2], omega = s->v[2], alpha = s->a[2];
    V2 t[3], b = base;
    for (int j = 0; j < 3; j++) {
        psi += s->q[first + j];
        omega += s->v[first + j];
        alpha += s->a[first + j];
        double sine = sin(psi), cosine = cos(psi);
        leg->omega[j] = omega;
        leg->alpha[j] = alpha;
        leg->l[j] = (V2){length[j] * sine, -length[j] * cosine};
        if (j < 2)
            leg->w[j] = (V2){m[j] * sine, -m[j] * cosine};
        else
            leg->w[j] = (V2){p->foot * (cosine * p->foot_x - sine * p->foot_y),
                             p->foot * (sine * p->foot_x + cosine * p->foot_y)};
        leg->b[j] = b;
        t[j] = swung(leg->w[j], alpha, omega * omega);
        b = add(b, swung(leg->l[j], alpha, omega * omega));
    }
    leg->F[2] = (V2){0.0, 0.0};
    leg->F[1] = add(t[2], reaction);
    leg->F[0] = add(leg->F[1], t[1]);
    leg->t = add(leg->F[0], t[0]); /* the reaction acts at the hips as well */
    leg->J[0] = p->thigh_i + p->thigh * p->thigh_c * p->thigh_c + (p->shank + p->foot) * p->thigh_l * p->thigh_l;
    leg->J[1] = p->shank_i + p->shank * p->shank_c * p->shank_c + p->foot * p->shank_l * p->shank_l;
    leg->J[2] = p->foot_i + p->foot * (p->foot_x * p->foot_x + p->foot_y * p->foot_y);
}

typedef struct {
    Leg leg[2];
    V2 base, w, t; /* A - g, first moment and force of the trunk */
    double J, mass;
} Pose;

static inline void pose_at(const Model *p, const Point *s, Pose *pose)
{
    V2 reaction = {s->lam[0], s->lam[1]}, none = {0.0, 0.0};
    double sine = sin(s->q[2]), cosine = cos(s->q[2]), moment = p->trunk * p->trunk_c;
    pose->base = (V2){s->a[0] - p->gx, s->a[1] - p->gy};
    leg_at(p, s, 3, pose->base, reaction, &pose->leg[0]);
    leg_at(p, s, 6, pose->base, none, &pose->leg[1]);
    pose->w = (V2){-moment * sine, moment * cosine};
    pose->t = swung(pose->w, s->a[2], s->v[2] * s->v[2]);
    pose->J = p->trunk_i + moment * p->trunk_c;
    pose->mass = p->trunk + 2.0 * (p->thigh + p->shank + p->foot);
}

static inline void balance(const Pose *pose, const Point *s, double r[N], double h[M], double rate[M])
{
    V2 force = add(times(pose->mass, pose->base), add(pose->t, add(pose->leg[0].t, pose->leg[1].t)));
    double torque[2];
    for (int side = 0; side < 2; side++) {
        const Leg *leg = &pose->leg[side];
        torque[side] = side == 0 ? s->lam[2] : 0.0;
        for (int j = 2; j >= 0; j--) {
            torque[side] += dot(turned(leg->w[j]), leg->b[j]) + dot(turned(leg->l[j]), leg->F[j]);
            torque[side] += leg->J[j] * leg->alpha[j];
            r[3 + 3 * side + j] = torque[side];
        }
    }
    r[0] = force.x;
    r[1] = force.y;
    r[2] = torque[0] + torque[1] + dot(turned(pose->w), pose->base) + pose->J * s->a[2];
    const Leg *stance = &pose->leg[0];
    V2 place = add(stance->l[0], stance->l[1]);
    V2 speed = turned(add(times(stance->omega[0], stance->l[0]), times(stance->omega[1], stance->l[1])));
    h[0] = s->q[0] + place.x;
    h[1] = s->q[1] + place.y;
    h[2] = s->q[2] + s->q[3] + s->q[4] + s->q[5];
    rate[0] = s->v[0] + speed.x;
    rate[1] = s->v[1] + speed.y;
    rate[2] = stance->omega[2];
}

static void residual(const Model *p, const Point *s, double r[N], double h[M], double rate[M])
{
    Pose pose;
    pose_at(p, s, &pose);
    balance(&pose, s, r, h, rate);
}

/* [S  B'; B~  0] with S = dr/da + C dr/dv + K dr/dq and B~ = B + G d(rate)/dq, beside the residual. */
static void tangent(const Model *p, const Point *s, double C, double K, double G, double A[SIZE][SIZE], double r[N],
                    double h[M], double rate[M])
{
    Pose pose;
    pose_at(p, s, &pose);
    balance(&pose, s, r, h, rate);
    memset(A, 0, sizeof(double) * SIZE * SIZE);

    double omega = s->v[2];
    V2 down = swung(pose.w, 1.0 - K * omega * omega, K * s->a[2] + 2.0 * C * omega), over = turned(pose.w);
    A[2][2] = pose.J - K * dot(pose.w, pose.base);
    for (int side = 0; side < 2; side++) {
        const Leg *leg = &pose.leg[side];
        V2 column[3], row[3], link[3];
        double block[3][3];
        for (int j = 0; j < 3; j++) {
            double along = 1.0 - K * leg->omega[j] * leg->omega[j];
            double across = K * leg->alpha[j] + 2.0 * C * leg->omega[j];
            column[j] = swung(leg->w[j], along, across);
            link[j] = swung(leg->l[j], along, across);
            row[j] = turned(leg->w[j]);
        }
        for (int j = 0; j < 3; j++) {
            block[j][j] = leg->J[j] - K * (dot(leg->w[j], leg->b[j]) + dot(leg->l[j], leg->F[j]));
            for (int k = j + 1; k < 3; k++) {
                block[j][k] = dot(turned(leg->l[j]), column[k]);
                block[k][j] = dot(row[k], link[j]);
            }
        }
        for (int j = 1; j >= 0; j--) {
            column[j] = add(column[j], column[j + 1]);
            row[j] = add(row[j], row[j + 1]);
            for (int k = 0; k < 3; k++)
                block[k][j] += block[k][j + 1];
        }
        for (int j = 1; j >= 0; j--)
            for (int k = 0; k < 3; k++)
                block[j][k] += block[j + 1][k];
        int o = 3 + 3 * side;
        for (int j = 0; j < 3; j++) {
            A[0][o + j] = column[j].x;
            A[1][o + j] = column[j].y;
            A[2][o + j] = block[0][j];
            A[o + j][0] = row[j].x;
            A[o + j][1] = row[j].y;
            A[o + j][2] = block[j][0];
            for (int k = 0; k < 3; k++)
                A[o + j][o + k] = block[j][k];
        }
        down = add(down, column[0]);
        over = add(over, row[0]);
        A[2][2] += block[0][0];
    }
    A[0][0] = A[1][1] = pose.mass;
    A[0][2] = down.x;
    A[1][2] = down.y;
    A[2][0] = over.x;
    A[2][1] = over.y;

    const Leg *stance = &pose.leg[0];
    V2 knee = turned(stance->l[1]), hip = add(knee, turned(stance->l[0]));
    V2 knee_turn = times(-G * stance->omega[1], stance->l[1]);
    V2 hip_turn = add(knee_turn, times(-G * stance->omega[0], stance->l[0]));
    A[0][9] = A[9][0] = A[1][10] = A[10][1] = 1.0;
    A[2][9] = A[3][9] = hip.x;
    A[2][10] = A[3][10] = hip.y;
    A[4][9] = knee.x;
    A[4][10] = knee.y;
    A[9][2] = A[9][3] = hip.x + hip_turn.x;
    A[10][2] = A[10][3] = hip.y + hip_turn.y;
    A[9][4] = knee.x + knee_turn.x;
    A[10][4] = knee.y + knee_turn.y;
    for (int j = 2; j < 6; j++)
        A[j][11] = A[11][j] = 1.0;
}

/* d/dt(B) v, the part of the second derivatives of the rows without accelerations. */
static void row_bias(const Model *p, const Point *s, double bias[M])
{
    Pose pose;
    pose_at(p, s, &pose);
    const Leg *stance = &pose.leg[0];
    V2 inward = add(times(stance->omega[0] * stance->omega[0], stance->l[0]),
                    times(stance->omega[1] * stance->omega[1], stance->l[1]));
    bias[0] = -inward.x;
    bias[1] = -inward.y;
    bias[2] = 0.0;
}

/* Sizes of r, of the rows and of their rates: every term by its largest possible value. */
static void magnitudes(const Model *p, const Point *s, double r[N], double h[M], double rate[M])
{
    Pose pose;
    pose_at(p, s, &pose);
    double pull = hypot(s->lam[0], s->lam[1]), base = hypot(pose.base.x, pose.base.y), leg_torque[2];
    double force = pose.mass * base + hypot(pose.t.x, pose.t.y) + pull;
    for (int side = 0; side < 2; side++) {
        const Leg *leg = &pose.leg[side];
        leg_torque[side] = side == 0 ? fabs(s->lam[2]) : 0.0;
        for (int j = 2; j >= 0; j--) {
            double moment = hypot(leg->w[j].x, leg->w[j].y), length = hypot(leg->l[j].x, leg->l[j].y);
            leg_torque[side] += moment * hypot(leg->b[j].x, leg->b[j].y) + length * hypot(leg->F[j].x, leg->F[j].y);
            leg_torque[side] += leg->J[j] * fabs(leg->alpha[j]);
            r[3 + 3 * side + j] = leg_torque[side];
            force += moment * (fabs(leg->alpha[j]) + leg->omega[j] * leg->omega[j]);
        }
    }
    r[0] = r[1] = force;
    r[2] = leg_torque[0] + leg_torque[1] + hypot(pose.w.x, pose.w.y) * base + pose.J * fabs(s->a[2]);
    h[0] = fabs(s->q[0]) + p->thigh_l + p->shank_l;
    h[1] = fabs(s->q[1]) + p->thigh_l + p->shank_l;
    h[2] = fabs(s->q[2]) + fabs(s->q[3]) + fabs(s->q[4]) + fabs(s->q[5]);
    double speed = fabs(pose.leg[0].omega[0]) * p->thigh_l + fabs(pose.leg[0].omega[1]) * p->shank_l;
    rate[0] = fabs(s->v[0]) + speed;
    rate[1] = fabs(s->v[1]) + speed;
    rate[2] = fabs(s->v[2]) + fabs(s->v[3]) + fabs(s->v[4]) + fabs(s->v[5]);
}
