/* When a robot that stands is given up, and what its joints do then; as opspace.FallRule has it. */
#include "opspace_inside.h"

#include <math.h>
#include <stdlib.h>

int opspace_make_fall(opspace *c)
{
    c->fall.last = calloc((size_t)c->model->n, sizeof *c->fall.last);
    return c->fall.last != NULL;
}

/* Let the robot stand again. */
void opspace_forget_fall(opspace *c)
{
    c->fall.hopeless = c->fall.fell = 0;
    c->fall.fastest = c->fall.most = 0.0;
    for (int i = 0; i < c->model->n; i++)
        c->fall.last[i] = 0.0;
}

/* Speed of the centre of mass: the momentum over the mass. */
static double speed(const opspace *c)
{
    int n = c->model->n;
    double square = 0.0;
    for (int k = 0; k < 3; k++) {
        double momentum = 0.0;
        for (int i = 0; i < n; i++)
            momentum += c->M[k * n + i] * c->v[i];
        square += momentum * momentum;
    }
    return sqrt(square) / c->M[0];
}

static int gets_better(opspace *c, double given_up)
{
    double now = speed(c);
    int slower = now < c->fall.fastest - FALL_SLOWER, less = given_up < c->fall.most - FALL_LESS;
    c->fall.fastest = slower || now > c->fall.fastest ? now : c->fall.fastest;
    c->fall.most = less || given_up > c->fall.most ? given_up : c->fall.most;
    return slower || less;
}

/* How far the vertical has turned in the base, as a cosine. */
static double upright(const opspace *c)
{
    const double *up = c->model->fall->upright;
    double w = c->q[3], x = c->q[4], y = c->q[5], z = c->q[6];
    return 2.0 * (x * z - w * y) * up[0] + 2.0 * (y * z + w * x) * up[1]
        + (1.0 - 2.0 * (x * x + y * y)) * up[2];
}

static int falls(opspace *c, double t, int64_t status)
{
    double given_up = c->hindrance * FALL_MAY_GIVE_UP;
    if (!(status & OPSPACE_NOT_BALANCED)) {
        c->fall.hopeless = 0;
    } else if (!c->fall.hopeless) {
        c->fall.hopeless = 1;
        c->fall.since = t;
        c->fall.fastest = speed(c);
        c->fall.most = given_up;
    } else if (gets_better(c, given_up)) {
        c->fall.since = t;
    }
    return (c->fall.hopeless && t - c->fall.since >= c->model->fall->after)
        || upright(c) < c->model->fall->cosine;
}

static void damp(const opspace *c, double since, double *tau)
{
    int n = c->model->n;
    double part = fmin(fmax(since, 0.0) / FALL_SLACKENING, 1.0);
    double left = 1.0 - opspace_profile(PROFILE_QUINTIC, part);
    for (int i = 0; i < n; i++) {
        double most = i < c->model->base ? 0.0 : fmin(c->torque_limit[i], 1.7976931348623157e308);
        double x = left * c->fall.last[i] - c->option[OPTION_DAMPING] * c->M[i * n + i] * c->v[i];
        tau[i] = isnan(x) ? 0.0 : fmax(fmin(x, most), -most);
    }
}

/* Look at a step that has a torque, and put another one in its place once the robot falls. */
int64_t opspace_watch_fall(opspace *c, double t, int64_t status, double *tau)
{
    if (!c->model->fall)
        return 0;
    if (!c->fall.fell) {
        if (!falls(c, t, status)) {
            opspace_copy(c->fall.last, tau, c->model->n);
            return 0;
        }
        c->fall.fell = 1;
        c->fall.fell_at = t;
    }
    damp(c, t - c->fall.fell_at, tau);
    return OPSPACE_FALLING;
}
