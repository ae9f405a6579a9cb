/* Activations in time, as opspace.law.Ramp has them. */
#include "opspace_inside.h"

#include <math.h>

enum { PROFILE, TARGET, START, DURATION, PHASE, RATE, ACCELERATION, WIDTH, CRUISE };

double opspace_profile(int code, double s)
{
    double h = s;
    if (s <= 0.0)
        return 0.0;
    if (s >= 1.0)
        return 1.0;
    if (code == PROFILE_QUINTIC)
        h = pow(s, 3.0) * (10.0 + s * (6.0 * s - 15.0));
    else if (code == PROFILE_CUBIC)
        h = s * s * (3.0 - 2.0 * s);
    else if (code == PROFILE_HALF_SINE)
        h = 0.5 - 0.5 * cos(HALF_TURN * s);
    else if (code == PROFILE_TANH)
        h = !(TANH_EDGE < s && s < 1.0 - TANH_EDGE)
            ? (s > 0.5 ? 1.0 : 0.0)
            : 0.5 * (1.0 + tanh(1.0 / (1.0 - s) - 1.0 / s));
    else if (code == PROFILE_STEP)
        h = s >= 0.5 ? 1.0 : 0.0;
    return fmin(fmax(h, 0.0), 1.0);
}

/* Phase of an activation in time, its rate and its acceleration: the rate is led by a cubic from what
 * it was to what it is to be, and stays there. */
static void phase_at(const double *x, double t, double *s, double *rate, double *acceleration)
{
    double tau = fmax(t - x[START], 0.0), w = x[WIDTH];
    if (t >= x[START] + x[DURATION]) {
        *s = x[TARGET];
        *rate = *acceleration = 0.0;
        return;
    }
    if (tau >= w) {
        double covered = w * ((x[RATE] + x[CRUISE]) / 2.0 + w * x[ACCELERATION] / 12.0);
        *s = x[PHASE] + covered + x[CRUISE] * (tau - w);
        *rate = x[CRUISE];
        *acceleration = 0.0;
        return;
    }
    double y = tau / w, y2 = pow(y, 2.0), y3 = pow(y, 3.0), y4 = pow(y, 4.0);
    *s = x[PHASE] + w * (x[RATE] * (y4 / 2 - y3 + y)
        + x[ACCELERATION] * w * (y4 / 4 - 2 * y3 / 3 + y2 / 2) + x[CRUISE] * (y3 - y4 / 2));
    *rate = x[RATE] * (2 * y3 - 3 * y2 + 1) + x[ACCELERATION] * w * (y3 - 2 * y2 + y)
        + x[CRUISE] * (3 * y2 - 2 * y3);
    *acceleration = (x[CRUISE] - x[RATE]) * (6 * y - 6 * y2) / w
        + x[ACCELERATION] * (3 * y2 - 4 * y + 1);
}

static void write_ramp(
    double *x, double target, double t, double duration, double phase, double rate,
    double acceleration, double width, double cruise)
{
    x[TARGET] = target;
    x[START] = t;
    x[DURATION] = duration;
    x[PHASE] = phase;
    x[RATE] = rate;
    x[ACCELERATION] = acceleration;
    x[WIDTH] = width;
    x[CRUISE] = cruise;
}

int opspace_arrived(const double *x, double t)
{
    return x[DURATION] == 0.0 || t >= x[START] + x[DURATION];
}

double opspace_activation(const double *x, double t)
{
    double s, rate, acceleration;
    phase_at(x, t, &s, &rate, &acceleration);
    return opspace_profile((int)x[PROFILE], s);
}

void opspace_rest(double *x, double profile, double target)
{
    x[PROFILE] = profile;
    write_ramp(x, target, 0.0, 0.0, target, 0.0, 0.0, 0.0, 0.0);
}

/* Turn it towards 0 or 1 at time t, to arrive so many seconds later. */
void opspace_send(double *x, double target, double t, double duration)
{
    double s, rate, acceleration;
    if (opspace_arrived(x, t) && x[TARGET] == target)
        return;
    if (duration < 1e-9 || t + duration == t) {
        write_ramp(x, target, t, 0.0, target, 0.0, 0.0, 0.0, 0.0);
        return;
    }
    phase_at(x, t, &s, &rate, &acceleration);
    if (!(s > 0.0 && s < 1.0)) {
        double edge = fmin(fmax(s, 0.0), 1.0), cruise = (target - edge) / duration;
        write_ramp(x, target, t, duration, edge, cruise, 0.0, 0.0, cruise);
        return;
    }
    double blend = 0.5 * duration;
    if (rate != 0.0)
        blend = fmin(blend, 0.25 / fabs(rate));
    if (acceleration != 0.0)
        blend = fmin(blend, 1.0 / sqrt(fabs(acceleration)));
    double covered = blend * (rate / 2.0 + blend * acceleration / 12.0);
    double cruise = (target - s - covered) / (duration - 0.5 * blend);
    write_ramp(x, target, t, duration, s, rate, acceleration, blend, cruise);
}
