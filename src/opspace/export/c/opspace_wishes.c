/* What may be asked for from any thread, between two steps. */
#include "opspace_inside.h"

#include <math.h>
#include <stdlib.h>

/* Numbers of the longest letter. */
static int longest(const opspace_model *m)
{
    int most = 12 + 6 + 6;
    for (int i = 0; i < m->tasks; i++)
        if (3 * m->task[i].rows > most)
            most = 3 * m->task[i].rows;
    return most;
}

int opspace_make_ring(opspace *c)
{
    int size = longest(c->model);
    c->paper = calloc((size_t)LETTERS * (size_t)size, sizeof *c->paper);
    if (!c->paper)
        return 0;
    for (unsigned i = 0; i < LETTERS; i++) {
        c->ring[i].turn = i;
        c->ring[i].x = c->paper + i * (unsigned)size;
    }
    return 1;
}

/* Take the next empty letter; NULL where there is none. */
static letter *empty_letter(opspace *c, int what, int about, unsigned *number)
{
    unsigned mine = __atomic_load_n(&c->written, __ATOMIC_RELAXED);
    for (;;) {
        letter *one = &c->ring[mine % LETTERS];
        unsigned turn = __atomic_load_n(&one->turn, __ATOMIC_ACQUIRE);
        if (turn == mine) {
            if (__atomic_compare_exchange_n(
                    &c->written, &mine, mine + 1, 0, __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
                one->what = what;
                one->about = about;
                *number = mine;
                return one;
            }
        } else if ((int)(turn - mine) < 0) {
            return NULL;
        } else {
            mine = __atomic_load_n(&c->written, __ATOMIC_RELAXED);
        }
    }
}

static void send(letter *one, unsigned number)
{
    __atomic_store_n(&one->turn, number + 1, __ATOMIC_RELEASE);
}

/* Send a letter of three numbers. */
static int send_three(opspace *c, int what, int about, double x, double y, double z)
{
    unsigned number;
    letter *letter = empty_letter(c, what, about, &number);
    if (!letter)
        return OPSPACE_BUSY;
    letter->x[0] = x;
    letter->x[1] = y;
    letter->x[2] = z;
    send(letter, number);
    return 0;
}

/* Whether something can begin at a time and take so long. */
static int can_begin(double t, double duration)
{
    return isfinite(t) && isfinite(duration) && duration >= 0.0;
}

static int is_rotation(const double *R)
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double product = 0.0;
            for (int k = 0; k < 3; k++)
                product += R[3 * i + k] * R[3 * j + k];
            if (!(fabs(product - (i == j)) < 1e-6))
                return 0;
        }
    double volume = R[0] * (R[4] * R[8] - R[5] * R[7]) - R[1] * (R[3] * R[8] - R[5] * R[6])
        + R[2] * (R[3] * R[7] - R[4] * R[6]);
    return volume > 0.0;
}

/* A target that jumps is another one, to which angles take the short way. */
static int rotation_jumps(const double *before, const double *now)
{
    double trace = 0.0;
    for (int i = 0; i < 9; i++)
        trace += before[i] * now[i];
    return 0.5 * (trace - 1.0) < cos(TARGET_STEP);
}

static int joints_jump(const opspace *c, const opspace_task *task, const double *x)
{
    for (int i = 0; i < task->rows; i++) {
        double moved = x[i] - c->goal[3 * (task->first_row + i)];
        moved -= 2.0 * HALF_TURN * nearbyint(moved / (2.0 * HALF_TURN));
        if (fabs(moved) > TARGET_STEP)
            return 1;
    }
    return 0;
}

static int finite_or_none(const double *x, int count)
{
    return !x || opspace_all_finite(x, count);
}

/* Numbers of the velocity of a target. */
int opspace_speeds_of(const opspace_task *one)
{
    return one->joints ? one->joints : (one->position ? 3 : 0) + (one->orientation ? 3 : 0);
}

int opspace_set_target(
    opspace *c, int task, const double *x, const double *velocity, const double *acceleration)
{
    const opspace_task *one = opspace_task_at(c, task);
    if (!one)
        return OPSPACE_NO_TASK;
    int size = opspace_speeds_of(one), given = one->joints + one->position + one->orientation;
    if (given == 0 || !opspace_all_finite(x, given) || !finite_or_none(velocity, size)
        || !finite_or_none(acceleration, size))
        return OPSPACE_REFUSED;
    if (one->orientation && !is_rotation(x + one->position))
        return OPSPACE_REFUSED;
    unsigned number;
    letter *letter = empty_letter(c, TARGET_LETTER, task, &number);
    if (!letter)
        return OPSPACE_BUSY;
    opspace_copy(letter->x, x, given);
    opspace_copy(letter->x + given, velocity, size);
    opspace_copy(letter->x + given + size, acceleration, size);
    send(letter, number);
    return 0;
}

static void go_to_joints(opspace *c, const opspace_task *one, int64_t *kind, const double *x)
{
    if (joints_jump(c, one, x))
        kind[KIND_REMEMBERS] = 0;
    for (int i = 0; i < one->joints; i++)
        for (int k = 0; k < 3; k++)
            c->goal[3 * (one->first_row + i) + k] = x[k * one->joints + i];
}

void opspace_go_to(opspace *c, int task, const double *x)
{
    const opspace_task *one = &c->model->task[task];
    int64_t *kind = c->kind + task * KIND_SIZE;
    if (one->joints) {
        go_to_joints(c, one, kind, x);
        return;
    }
    double *number = c->numbers + task * NUMBERS_SIZE;
    const double *R = x + one->position, *speeds = R + one->orientation;
    if (one->orientation) {
        if (rotation_jumps(number + NUMBERS_GOAL_ROTATION, R))
            kind[KIND_REMEMBERS] = 0;
        opspace_copy(number + NUMBERS_GOAL_ROTATION, R, 9);
    }
    if (one->position)
        opspace_copy(number + NUMBERS_GOAL_POSITION, x, 3);
    int size = opspace_speeds_of(one);
    opspace_copy(number + NUMBERS_GOAL_VELOCITY, speeds, size);
    opspace_copy(number + NUMBERS_GOAL_ACCELERATION, speeds + size, size);
}

int opspace_set_gains(opspace *c, int task, const double *kp, const double *kv)
{
    const opspace_task *one = opspace_task_at(c, task);
    if (!one)
        return OPSPACE_NO_TASK;
    const double *row = opspace_press_of(c, task);
    for (int i = 0; i < one->rows; i++)
        if (row && (kp[i] != 0.0 || !(row[PRESS_KI] <= 0.5 * kv[i] * (1.0 + row[PRESS_KP]))))
            return OPSPACE_REFUSED;
    for (int i = 0; i < one->rows; i++)
        if (c->sums.ki && c->sums.ki[task] > 0.0 && !(c->sums.ki[task] < kp[i] * kv[i]))
            return OPSPACE_REFUSED;
    for (int i = 0; i < one->rows; i++)
        if (!isfinite(kp[i]) || !isfinite(kv[i]) || kp[i] < 0.0 || kv[i] < 0.0)
            return OPSPACE_REFUSED;
    unsigned number;
    letter *letter = empty_letter(c, GAINS_LETTER, task, &number);
    if (!letter)
        return OPSPACE_BUSY;
    opspace_copy(letter->x, kp, one->rows);
    opspace_copy(letter->x + one->rows, kv, one->rows);
    send(letter, number);
    return 0;
}

/* Size of what a force task presses with, without its moments. */
static double force_of(const double *row, const double *wanted)
{
    double size = 0.0;
    for (int i = 0; i < (int)row[PRESS_FORCES]; i++)
        size += wanted[i] * wanted[i];
    return sqrt(size);
}

int opspace_set_force(opspace *c, int task, const double *force)
{
    const opspace_task *one = opspace_task_at(c, task);
    if (!one)
        return OPSPACE_NO_TASK;
    const double *row = opspace_press_of(c, task);
    if (!row || !opspace_all_finite(force, one->rows))
        return OPSPACE_REFUSED;
    double size = force_of(row, force);
    if (size == 0.0 || (!one->graded && size < row[PRESS_ON]))
        return OPSPACE_REFUSED;
    unsigned number;
    letter *letter = empty_letter(c, FORCE_LETTER, task, &number);
    if (!letter)
        return OPSPACE_BUSY;
    opspace_copy(letter->x, force, one->rows);
    send(letter, number);
    return 0;
}

/* Take a change of place for whoever asks for one; 0 where all are on their way. */
static int take_change(opspace *c)
{
    int there = __atomic_load_n(&c->room, __ATOMIC_RELAXED);
    while (there > 0)
        if (__atomic_compare_exchange_n(
                &c->room, &there, there - 1, 0, __ATOMIC_ACQUIRE, __ATOMIC_RELAXED))
            return 1;
    return 0;
}

static int ask_for_change(
    opspace *c, int what, int task, double other, double t, double duration)
{
    if (c->model->moves == 0 || !can_begin(t, duration))
        return OPSPACE_REFUSED;
    if (!take_change(c))
        return OPSPACE_BUSY;
    int answer = send_three(c, what, task, other, t, duration);
    if (answer)
        __atomic_fetch_add(&c->room, 1, __ATOMIC_RELEASE);
    return answer;
}

int opspace_move(opspace *c, int task, double level, double t, double duration)
{
    if (!opspace_task_at(c, task))
        return OPSPACE_NO_TASK;
    for (int i = 0; i < c->model->levels; i++)
        if (c->model->level[i] == level)
            return ask_for_change(c, MOVE_LETTER, task, i, t, duration);
    return OPSPACE_REFUSED;
}

int opspace_swap(opspace *c, int first, int second, double t, double duration)
{
    if (!opspace_task_at(c, first) || !opspace_task_at(c, second))
        return OPSPACE_NO_TASK;
    if (first == second)
        return OPSPACE_REFUSED;
    return ask_for_change(c, SWAP_LETTER, first, second, t, duration);
}

int opspace_set_contact(opspace *c, int contact, int present, double duration, int wait)
{
    if (contact < 0 || contact >= c->model->contacts)
        return OPSPACE_NO_TASK;
    if (!can_begin(0.0, duration))
        return OPSPACE_REFUSED;
    return send_three(c, CONTACT_LETTER, contact, present != 0, duration, wait != 0);
}

int opspace_set_presence(opspace *c, int task, int present, double t, double duration)
{
    if (!opspace_task_at(c, task))
        return OPSPACE_NO_TASK;
    if (!can_begin(t, duration))
        return OPSPACE_REFUSED;
    return send_three(c, PRESENCE_LETTER, task, present != 0, t, duration);
}

/* Another force has other thresholds of contact, unless they were given. */
static void press_with(double *row, const opspace_task *task, const double *force)
{
    opspace_copy(row + PRESS_WANTED, force, task->rows);
    if (task->graded) {
        row[PRESS_OFF] = 0.1 * force_of(row, force);
        row[PRESS_ON] = 0.4 * force_of(row, force);
    }
}

static void open_letter(opspace *c, const letter *one)
{
    const double *x = one->x;
    const opspace_task *task = &c->model->task[one->about];
    switch (one->what) {
    case TARGET_LETTER:
        if (task->led) {
            opspace_tell_way(c, one->about, x);
        } else {
            opspace_go_to(c, one->about, x);
            opspace_note_acceleration(c, one->about);
        }
        break;
    case GAINS_LETTER:
        opspace_copy(c->kp + task->first_row, x, task->rows);
        opspace_copy(c->kv + task->first_row, x + task->rows, task->rows);
        break;
    case FORCE_LETTER:
        press_with(opspace_press_of(c, one->about), task, x);
        break;
    default:
        opspace_let_touch(c, one->about, x[0] != 0.0, x[1], x[2] != 0.0);
    }
}

/* Take what is asked for; a letter that is being written waits for the next step, and so does one with
 * a time where all that wait for theirs are too many. */
void opspace_read_letters(opspace *c)
{
    for (int i = 0; i < LETTERS; i++) {
        letter *one = &c->ring[c->taken % LETTERS];
        if (__atomic_load_n(&one->turn, __ATOMIC_ACQUIRE) != c->taken + 1)
            return;
        if (!opspace_has_time(one->what))
            open_letter(c, one);
        else if (!opspace_let_wait(c, one))
            return;
        __atomic_store_n(&one->turn, c->taken + LETTERS, __ATOMIC_RELEASE);
        c->taken++;
    }
}
