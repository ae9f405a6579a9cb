/* Integral action of tasks that have it, as opspace.controller.integral; the kernels add errors up. */
#include "opspace_inside.h"

#include <stdlib.h>
#include <string.h>

extern void opspace_learn(void *handle, void *integrals, int64_t status);

int opspace_make_integrals(opspace *c)
{
    const opspace_model *m = c->model;
    if (m->integrals < 0)
        return 1;
    const opspace_task *last = &m->task[m->tasks - 1];
    size_t numbers = (size_t)(6 * m->tasks + last->first_row + last->rows);
    c->sums.ahead = calloc(numbers, sizeof *c->sums.ahead);
    return c->sums.ahead != NULL;
}

/* Remember what tasks are told to accelerate, beside what the integrals add. */
void opspace_note_acceleration(opspace *c, int task)
{
    const opspace_task *one = &c->model->task[task];
    if (!c->sums.ahead)
        return;
    memcpy(c->sums.ahead + 6 * task,
        c->numbers + task * NUMBERS_SIZE + NUMBERS_GOAL_ACCELERATION, 6 * sizeof *c->numbers);
    for (int row = one->first_row; row < one->first_row + one->rows; row++)
        c->sums.ahead[6 * c->model->tasks + row] = c->goal[3 * row + 2];
}

void opspace_push_integrals(opspace *c)
{
    const opspace_model *m = c->model;
    for (int i = 0; c->sums.ahead && i < m->tasks; i++) {
        const opspace_task *one = &m->task[i];
        if (c->sums.ki[i] == 0.0)
            continue;
        int led = opspace_is_led(c, i); /* the kernels add it to what a way asks for */
        double *to = c->numbers + i * NUMBERS_SIZE + NUMBERS_GOAL_ACCELERATION;
        for (int k = 0; k < 6 && !one->joints; k++)
            to[k] = c->sums.ahead[6 * i + k] + (led ? 0.0 : c->sums.motion[6 * i + k]);
        for (int row = one->first_row; row < one->first_row + one->joints; row++)
            c->goal[3 * row + 2]
                = c->sums.ahead[6 * m->tasks + row] + (led ? 0.0 : c->sums.joint[row]);
        if (led) {
            memcpy(c->ways.more + 6 * i, c->sums.motion + 6 * i, 6 * sizeof *c->ways.more);
            memcpy(c->ways.joint_more + one->first_row, c->sums.joint + one->first_row,
                (size_t)one->rows * sizeof *c->ways.joint_more);
        }
    }
}

/* Add the errors of a step; what happened in it decides whether they teach anything. */
void opspace_learn_errors(opspace *c, double t, int64_t status)
{
    if (!c->sums.ahead)
        return;
    *c->sums.since = c->sums.begun ? t - c->sums.before : 0.0;
    c->sums.before = t;
    c->sums.begun = 1;
    opspace_learn(c->handle, c->words + c->model->integrals, status);
}

/* A task that comes anew has learned nothing. */
void opspace_forget_integral(opspace *c, int task)
{
    const opspace_task *one = &c->model->task[task];
    if (!c->sums.ahead)
        return;
    memset(c->sums.motion + 6 * task, 0, 6 * sizeof *c->sums.motion);
    memset(c->sums.joint + one->first_row, 0, (size_t)one->rows * sizeof *c->sums.joint);
}
