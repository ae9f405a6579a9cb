/* Ways of tasks to their targets, as opspace.tasks.tracking; the kernels plan and follow them. */
#include "opspace_inside.h"

#include <stdlib.h>
#include <string.h>

/* Numbers of a target itself, then with its velocity and acceleration. */
static int goal_size(const opspace_task *one)
{
    return one->joints + one->position + one->orientation;
}

static int target_size(const opspace_task *one)
{
    return goal_size(one) + 2 * opspace_speeds_of(one);
}

int opspace_make_ways(opspace *c)
{
    const opspace_model *m = c->model;
    size_t most = 0, led = 0;
    for (int i = 0; i < m->tasks; i++) {
        size_t size = (size_t)target_size(&m->task[i]);
        led += (size_t)m->task[i].led;
        most = size > most ? size : most;
    }
    if (led == 0)
        return 1;
    c->ways.size = (int)most;
    c->ways.told = calloc(2 * (size_t)m->tasks * most, sizeof *c->ways.told);
    c->ways.fresh = calloc(2 * (size_t)m->tasks, sizeof *c->ways.fresh);
    c->ways.known = c->ways.fresh + m->tasks;
    return c->ways.told && c->ways.fresh;
}

static double *told(const opspace *c, int task)
{
    return c->ways.told + 2 * task * c->ways.size;
}

/* What has been told before that. */
static double *followed(const opspace *c, int task)
{
    return told(c, task) + c->ways.size;
}

/* Take what the model was exported with as told. */
void opspace_begin_ways(opspace *c)
{
    for (int i = 0; i < c->model->tasks; i++) {
        const opspace_task *one = &c->model->task[i];
        if (!one->led)
            continue;
        double *x = told(c, i);
        const double *number = c->numbers + i * NUMBERS_SIZE, *goal = c->ways.asked_goal + i * GOAL_SIZE;
        int asked = c->ways.asked[i] != 0, size = goal_size(one), speeds = opspace_speeds_of(one);
        for (int row = 0; row < one->joints; row++) {
            const double *place = c->goal + 3 * (one->first_row + row);
            x[row] = asked ? c->ways.joint_asked[one->first_row + row] : place[0];
            x[size + row] = asked ? 0.0 : place[1];
            x[size + speeds + row] = asked ? 0.0 : place[2];
        }
        if (!one->joints) {
            const double *place = asked ? goal + GOAL_PLACE : number + NUMBERS_GOAL_POSITION;
            const double *turn = asked ? goal + GOAL_TURN : number + NUMBERS_GOAL_ROTATION;
            opspace_copy(x, place, one->position);
            opspace_copy(x + one->position, turn, one->orientation);
            opspace_copy(x + size, asked ? NULL : number + NUMBERS_GOAL_VELOCITY, speeds);
            opspace_copy(
                x + size + speeds, asked ? NULL : number + NUMBERS_GOAL_ACCELERATION, speeds);
        }
        c->ways.fresh[i] = 1;
    }
}

/* Take a target; whether a task begins a way to it is seen when all that is told has been read. */
void opspace_tell_way(opspace *c, int task, const double *x)
{
    opspace_copy(told(c, task), x, target_size(&c->model->task[task]));
    c->ways.fresh[task] = 1;
}

/* A task that comes anew, or goes on after a pause, begins where it finds the robot. */
void opspace_forget_way(opspace *c, int task)
{
    if (!c->model->task[task].led)
        return;
    c->ways.asked[task] = c->ways.on[task] = c->ways.known[task] = 0;
    c->ways.fresh[task] = 1;
}

int opspace_is_led(const opspace *c, int task)
{
    return c->model->task[task].led && (c->ways.on[task] || c->ways.asked[task]);
}

static int same(const double *a, const double *b, int count)
{
    for (int i = 0; i < count; i++)
        if (a[i] != b[i])
            return 0;
    return 1;
}

static int at_rest(const double *x, int count)
{
    for (int i = 0; i < count; i++)
        if (x[i] != 0.0)
            return 0;
    return 1;
}

static void ask(opspace *c, int task, const double *x)
{
    const opspace_task *one = &c->model->task[task];
    double *goal = c->ways.asked_goal + task * GOAL_SIZE;
    opspace_copy(c->ways.joint_asked + one->first_row, x, one->joints);
    if (!one->joints) {
        opspace_copy(goal + GOAL_PLACE, x, one->position);
        opspace_copy(goal + GOAL_TURN, x + one->position, one->orientation);
    }
    if (!c->ways.asked[task])
        c->ways.asked[task] = c->ways.known[task] ? FROM_FOLLOWED : FROM_FOUND;
}

/* Begin the ways to what has been told since the last step. */
void opspace_lead(opspace *c)
{
    for (int i = 0; i < c->model->tasks; i++) {
        const opspace_task *one = &c->model->task[i];
        if (!one->led)
            continue;
        const double *x = told(c, i);
        int size = goal_size(one);
        if (c->ways.fresh[i] && !at_rest(x + size, opspace_speeds_of(one))) {
            c->ways.asked[i] = c->ways.on[i] = 0;
            opspace_go_to(c, i, x);
            opspace_note_acceleration(c, i);
        } else if (c->ways.fresh[i] && !(c->ways.on[i] && same(x, followed(c, i), size))) {
            ask(c, i, x);
        }
        if (c->ways.fresh[i])
            opspace_copy(followed(c, i), x, size);
        c->ways.fresh[i] = 0;
        c->ways.known[i] = 1;
    }
}
