/* Wishes with a time wait for it, and start as requests to a stack do. */
#include "opspace_inside.h"

#include <math.h>
#include <string.h>

/* Columns of a ramp that are used here. */
enum { TARGET = 1, START = 2 };

int opspace_has_time(int what)
{
    return what == PRESENCE_LETTER || what == MOVE_LETTER || what == SWAP_LETTER;
}

int opspace_let_wait(opspace *c, const letter *asked)
{
    if (c->timed == LETTERS)
        return 0;
    /* What should have started before the last step is as old as that. */
    double order = c->begun ? fmax(asked->x[1], c->before) : asked->x[1];
    int at = c->timed++;
    for (; at > 0 && c->later[at - 1].order > order; at--)
        c->later[at] = c->later[at - 1];
    wish *one = &c->later[at];
    one->what = asked->what;
    one->about = asked->about;
    one->order = order;
    memcpy(one->x, asked->x, sizeof one->x);
    return 1;
}

/* Whether a task has gone by this time, so that it comes anew. */
static int has_gone(const opspace *c, int task, double t)
{
    const double *ramp = c->variable + task * VARIABLE_SIZE;
    return ramp[TARGET] == 0.0 && opspace_arrived(ramp, t);
}

static void start(opspace *c, const wish *one, double t)
{
    const double *x = one->x;
    if (one->what == MOVE_LETTER)
        opspace_let_move(c, one->about, (int)x[0], t, x[2]);
    else if (one->what == SWAP_LETTER)
        opspace_let_swap(c, one->about, (int)x[0], t, x[2]);
    else {
        if (has_gone(c, one->about, t)) {
            opspace_forget_integral(c, one->about);
            opspace_forget_way(c, one->about);
            opspace_forget_touch(c, one->about);
            c->kind[one->about * KIND_SIZE + KIND_REMEMBERS] = 0;
        }
        opspace_send(c->variable + one->about * VARIABLE_SIZE, x[0], t, x[2]);
    }
}

/* What was to start until the step before starts with this one: an earlier start would be a step. */
void opspace_start_timed(opspace *c, double t)
{
    double before = c->begun ? fmin(c->before, t) : t;
    int due = 0;
    while (due < c->timed && c->later[due].x[1] <= t) {
        double at = c->later[0].x[1] <= before ? t : c->later[due].x[1];
        /* What arrives in this very moment is turned, if it is asked to. */
        opspace_tidy_places(c, nextafter(at, -INFINITY));
        start(c, &c->later[due++], at);
    }
    c->timed -= due;
    memmove(c->later, c->later + due, (size_t)c->timed * sizeof *c->later);
    opspace_tidy_places(c, t);
}

/* Let everything that has a time happen so much later. */
void opspace_pause(opspace *c, double pause)
{
    for (int i = 0; i < c->model->tasks; i++)
        c->variable[i * VARIABLE_SIZE + START] += pause;
    for (int k = 0; k < c->model->moves; k++)
        c->change[k].ramp[START] += pause;
    for (int i = 0; i < c->model->tasks; i++) {
        double *row = opspace_press_of(c, i);
        if (row) {
            row[PRESS_WHEN] += pause;
            /* A wrench that was given after the restart is of the new clock. */
            if (!(c->heard >> i & 1))
                row[PRESS_GIVEN_AT] += pause;
        }
    }
    for (int i = 0; i < c->timed; i++) {
        c->later[i].order += pause;
        c->later[i].x[1] += pause;
    }
    opspace_pack_places(c);
}
