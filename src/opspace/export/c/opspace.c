/* Everything of an exported controller that is not its mathematics; see opspace.h. */
#include "opspace_inside.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The kernels. */
extern int64_t opspace_tick(double t, void *handle);
extern void opspace_gravity(void *handle);
extern const char opspace_stamp[];

static const opspace_field *find_field(const opspace *c, const char *name)
{
    for (int i = 0; i < c->model->fields; i++)
        if (strcmp(c->model->field[i].name, name) == 0)
            return &c->model->field[i];
    return NULL;
}

static void *memory_of(const opspace *c, const char *name)
{
    const opspace_field *one = find_field(c, name);
    return one ? c->words + one->first : NULL;
}

static void lay_out(opspace *c)
{
    const opspace_model *m = c->model;
    const uint64_t *content = m->content;
    for (int64_t i = 0; i < m->runs; i++) {
        memcpy(c->words + m->run[i].first, content, (size_t)m->run[i].count * sizeof *content);
        content += m->run[i].count;
    }
    for (int64_t i = 0; i < m->addresses; i++) {
        uint64_t *word = c->words + m->address[i];
        *word = (uint64_t)(uintptr_t)(c->words + *word);
    }
    c->handle = c->words + m->handle;
}

static void find_fields(opspace *c)
{
    c->q = memory_of(c, "q");
    c->v = memory_of(c, "v");
    c->tau = memory_of(c, "tau");
    c->M = memory_of(c, "M");
    c->bias = memory_of(c, "bias");
    c->torque_limit = memory_of(c, "torque_limit");
    c->torque_middle = memory_of(c, "torque_middle");
    c->option = memory_of(c, "option");
    c->gravity = memory_of(c, "gravity");
    c->variable = memory_of(c, "variable");
    c->own = memory_of(c, "own");
    c->numbers = memory_of(c, "numbers");
    c->goal = memory_of(c, "goal");
    c->kp = memory_of(c, "kp");
    c->kv = memory_of(c, "kv");
    c->press = memory_of(c, "press");
    c->kind = memory_of(c, "kind");
    c->endless = memory_of(c, "endless");
    c->group = memory_of(c, "group");
    c->slots = memory_of(c, "slots");
    c->slot_on = memory_of(c, "slot_on");
    c->slot_off = memory_of(c, "slot_off");
    c->slot_place = memory_of(c, "slot_place");
    c->first_kept = memory_of(c, "space.first_kept");
    c->stance.count = memory_of(c, "stance.count");
    c->stance.rows = memory_of(c, "stance.rows");
    c->stance.place = memory_of(c, "stance.place");
    c->stance.edges = memory_of(c, "stance.edges");
    c->stance.numbers = memory_of(c, "stance.numbers");
    c->stance.motion = memory_of(c, "stance.motion");
    c->stance.force = memory_of(c, "stance.force");
    c->stance.most = memory_of(c, "stance.most");
    c->stance.cone = memory_of(c, "stance.cone");
    c->stance.metric = memory_of(c, "stance.metric");
    c->stance.reference = memory_of(c, "stance.reference");
    c->stance.hindrance = memory_of(c, "stance.hindrance");
}

/* Numbers of the longest letter. */
static int longest(const opspace_model *m)
{
    int most = 12 + 6 + 6;
    for (int i = 0; i < m->tasks; i++)
        if (3 * m->task[i].rows > most)
            most = 3 * m->task[i].rows;
    return most;
}

static int make_ring(opspace *c)
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

opspace *opspace_open(const opspace_model *model)
{
    if (!model || strcmp(model->stamp, opspace_stamp) != 0)
        return NULL;
    opspace *c = calloc(1, sizeof *c);
    if (!c)
        return NULL;
    c->model = model;
    c->words = calloc((size_t)model->words, sizeof *c->words);
    c->state = calloc((size_t)(model->nq + model->n), sizeof *c->state);
    if (!c->words || !c->state || !make_ring(c) || !opspace_make_places(c) || !opspace_make_contacts(c)) {
        opspace_close(c);
        return NULL;
    }
    c->last = c->state + model->nq;
    lay_out(c);
    find_fields(c);
    opspace_pack_places(c);
    return c;
}

void opspace_close(opspace *c)
{
    if (c) {
        free(c->words);
        free(c->paper);
        free(c->state);
        free(c->place);
        free(c->places);
        free(c->change);
        free(c->footing);
        free(c->touching);
    }
    free(c);
}

static int all_finite(const double *x, int count)
{
    for (int i = 0; i < count; i++)
        if (!isfinite(x[i]))
            return 0;
    return 1;
}

static int equal(const double *a, const double *b, int count)
{
    for (int i = 0; i < count; i++)
        if (a[i] != b[i])
            return 0;
    return 1;
}

static int moving(const double *v, int count)
{
    for (int i = 0; i < count; i++)
        if (v[i] != 0.0)
            return 1;
    return 0;
}

/* Whether the tick comes when it should, with a state that is new. */
static int64_t watch(const opspace *c, double t, const double *q, const double *v)
{
    const opspace_model *m = c->model;
    int64_t found = 0;
    if (m->period == 0.0 || !c->begun)
        return 0;
    double passed = t - c->before;
    if (!(1e-6 * m->period < passed && passed <= TIME_JUMP_PERIODS * m->period))
        found |= OPSPACE_TIME_JUMP;
    else if (passed > TIME_LATE_PERIODS * m->period)
        found |= OPSPACE_LATE;
    if (moving(v, m->n) && equal(q, c->q, m->nq) && equal(v, c->v, m->n))
        found |= OPSPACE_STALE;
    return found;
}

/* A robot that stands on nothing but contacts brakes from the torque that carried it. */
static void brake(const opspace *c, double *tau)
{
    int n = c->model->n;
    const double *held = c->carried ? c->last : c->bias;
    for (int i = 0; i < n; i++) {
        double most = i < c->model->base ? 0.0 : fmin(c->torque_limit[i], 1.7976931348623157e308);
        double middle = c->torque_middle[i];
        double x = held[i] - c->option[OPTION_DAMPING] * c->M[i * n + i] * c->v[i] - middle;
        tau[i] = isnan(x) ? 0.0 : fmax(fmin(x, most), -most) + middle;
    }
}

/* Leave to the robot what it adds. */
static void without_gravity(const opspace *c, double *tau)
{
    if (!c->model->robot_adds)
        return;
    opspace_gravity(c->handle);
    for (int i = 0; i < c->model->n; i++)
        if (isfinite(c->gravity[i]))
            tau[i] -= c->gravity[i];
}

/* What a force task remembers; NULL of another task. */
static double *press_of(const opspace *c, int task)
{
    const int64_t *kind = c->kind + task * KIND_SIZE;
    return kind[KIND_KIND] == KIND_FORCE ? c->press + kind[KIND_PRESS] * PRESS_SIZE : NULL;
}

static int all_measured(const opspace *c)
{
    for (int i = 0; i < c->model->tasks; i++) {
        const double *row = press_of(c, i);
        if (row && !isfinite(row[PRESS_GIVEN_AT]))
            return 0;
    }
    return 1;
}

static void read_letters(opspace *c);

/* Quaternions as they are to be; 0 where one has no direction. */
static int normalise(const opspace *c, double *q)
{
    for (int i = 0; i < c->model->quaternions; i++) {
        double *x = q + c->model->quaternion[i];
        double length = sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2] + x[3] * x[3]);
        if (!(length >= 1e-6 && isfinite(length)))
            return 0;
        for (int k = 0; k < 4; k++)
            x[k] /= length;
    }
    return 1;
}

static int64_t answered(opspace *c, int64_t answer, double *tau)
{
    const opspace_model *m = c->model;
    if (answer < 0) {
        brake(c, tau);
        without_gravity(c, tau);
        return OPSPACE_FAULT;
    }
    memcpy(tau, c->tau, (size_t)m->n * sizeof *tau);
    without_gravity(c, tau);
    if (m->base > 0) {
        memcpy(c->last, tau, (size_t)m->n * sizeof *tau);
        c->carried = 1;
        c->hindrance = *c->stance.hindrance;
    }
    return answer % ANSWER_SOLVE;
}

int64_t opspace_step(opspace *c, double t, const double *q, const double *v, double *tau)
{
    const opspace_model *m = c->model;
    if (!isfinite(t) || !all_finite(q, m->nq) || !all_finite(v, m->n))
        return OPSPACE_NOT_FINITE;
    memcpy(c->state, q, (size_t)m->nq * sizeof *q);
    if (!normalise(c, c->state))
        return OPSPACE_NOT_FINITE;
    if (!all_measured(c)) {
        read_letters(c);
        return OPSPACE_NO_WRENCH;
    }
    if (c->paused)
        opspace_pause(c, t - c->before);
    else
        opspace_move_contacts(c, c->begun ? fmax(0.0, t - c->before) : 0.0);
    c->paused = 0;
    read_letters(c);
    opspace_start_timed(c, t);
    int64_t found = watch(c, t, c->state, v);
    c->before = t;
    c->begun = 1;
    memcpy(c->q, c->state, (size_t)m->nq * sizeof *q);
    memcpy(c->v, v, (size_t)m->n * sizeof *v);
    if (m->base > 0)
        found |= opspace_touch(c);
    int64_t answer = opspace_tick(t, c->handle);
    return found | answered(c, answer, tau);
}

int opspace_find_task(const opspace *c, const char *name)
{
    for (int i = 0; i < c->model->tasks; i++)
        if (strcmp(c->model->task[i].name, name) == 0)
            return i;
    return OPSPACE_NO_TASK;
}

static const opspace_task *task_at(const opspace *c, int task)
{
    return task < 0 || task >= c->model->tasks ? NULL : &c->model->task[task];
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

static void copy(double *to, const double *from, int count)
{
    for (int i = 0; i < count; i++)
        to[i] = from ? from[i] : 0.0;
}

static int finite_or_none(const double *x, int count)
{
    return !x || all_finite(x, count);
}

/* Numbers of the velocity of a target. */
static int speeds_of(const opspace_task *one)
{
    return one->joints ? one->joints : (one->position ? 3 : 0) + (one->orientation ? 3 : 0);
}

int opspace_set_target(
    opspace *c, int task, const double *x, const double *velocity, const double *acceleration)
{
    const opspace_task *one = task_at(c, task);
    if (!one)
        return OPSPACE_NO_TASK;
    int size = speeds_of(one), given = one->joints + one->position + one->orientation;
    if (given == 0 || !all_finite(x, given) || !finite_or_none(velocity, size) || !finite_or_none(acceleration, size))
        return OPSPACE_REFUSED;
    if (one->orientation && !is_rotation(x + one->position))
        return OPSPACE_REFUSED;
    unsigned number;
    letter *letter = empty_letter(c, TARGET_LETTER, task, &number);
    if (!letter)
        return OPSPACE_BUSY;
    copy(letter->x, x, given);
    copy(letter->x + given, velocity, size);
    copy(letter->x + given + size, acceleration, size);
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

static void go_to(opspace *c, int task, const double *x)
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
        copy(number + NUMBERS_GOAL_ROTATION, R, 9);
    }
    if (one->position)
        copy(number + NUMBERS_GOAL_POSITION, x, 3);
    copy(number + NUMBERS_GOAL_VELOCITY, speeds, speeds_of(one));
    copy(number + NUMBERS_GOAL_ACCELERATION, speeds + speeds_of(one), speeds_of(one));
}

int opspace_set_gains(opspace *c, int task, const double *kp, const double *kv)
{
    const opspace_task *one = task_at(c, task);
    if (!one)
        return OPSPACE_NO_TASK;
    const double *row = press_of(c, task);
    for (int i = 0; i < one->rows; i++)
        if (row && (kp[i] != 0.0 || !(row[PRESS_KI] <= 0.5 * kv[i] * (1.0 + row[PRESS_KP]))))
            return OPSPACE_REFUSED;
    for (int i = 0; i < one->rows; i++)
        if (!isfinite(kp[i]) || !isfinite(kv[i]) || kp[i] < 0.0 || kv[i] < 0.0)
            return OPSPACE_REFUSED;
    unsigned number;
    letter *letter = empty_letter(c, GAINS_LETTER, task, &number);
    if (!letter)
        return OPSPACE_BUSY;
    copy(letter->x, kp, one->rows);
    copy(letter->x + one->rows, kv, one->rows);
    send(letter, number);
    return 0;
}

int opspace_set_wrench(opspace *c, int task, double t, const double *wrench)
{
    if (!task_at(c, task))
        return OPSPACE_NO_TASK;
    double *row = press_of(c, task);
    if (!row || !isfinite(t) || !all_finite(wrench, 6))
        return OPSPACE_REFUSED;
    copy(row + PRESS_GIVEN, wrench, 6);
    row[PRESS_GIVEN_AT] = t;
    return 0;
}

int opspace_set_force(opspace *c, int task, const double *force)
{
    const opspace_task *one = task_at(c, task);
    if (!one)
        return OPSPACE_NO_TASK;
    double *row = press_of(c, task), size = 0.0;
    if (!row || !all_finite(force, one->rows))
        return OPSPACE_REFUSED;
    for (int i = 0; i < (int)row[PRESS_FORCES]; i++)
        size += force[i] * force[i];
    if (sqrt(size) < row[PRESS_ON])
        return OPSPACE_REFUSED;
    unsigned number;
    letter *letter = empty_letter(c, FORCE_LETTER, task, &number);
    if (!letter)
        return OPSPACE_BUSY;
    copy(letter->x, force, one->rows);
    send(letter, number);
    return 0;
}

int opspace_set_activation(opspace *c, int task, double activation)
{
    if (!task_at(c, task))
        return OPSPACE_NO_TASK;
    if (!(activation >= 0.0 && activation <= 1.0))
        return OPSPACE_REFUSED;
    c->own[task] = activation;
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
    unsigned number;
    if (c->model->moves == 0 || !isfinite(t) || !isfinite(duration) || duration < 0.0)
        return OPSPACE_REFUSED;
    if (!take_change(c))
        return OPSPACE_BUSY;
    letter *letter = empty_letter(c, what, task, &number);
    if (!letter) {
        __atomic_fetch_add(&c->room, 1, __ATOMIC_RELEASE);
        return OPSPACE_BUSY;
    }
    letter->x[0] = other;
    letter->x[1] = t;
    letter->x[2] = duration;
    send(letter, number);
    return 0;
}

int opspace_move(opspace *c, int task, double level, double t, double duration)
{
    if (!task_at(c, task))
        return OPSPACE_NO_TASK;
    for (int i = 0; i < c->model->levels; i++)
        if (c->model->level[i] == level)
            return ask_for_change(c, MOVE_LETTER, task, i, t, duration);
    return OPSPACE_REFUSED;
}

int opspace_swap(opspace *c, int first, int second, double t, double duration)
{
    if (!task_at(c, first) || !task_at(c, second))
        return OPSPACE_NO_TASK;
    if (first == second)
        return OPSPACE_REFUSED;
    return ask_for_change(c, SWAP_LETTER, first, second, t, duration);
}

int opspace_find_contact(const opspace *c, const char *name)
{
    for (int i = 0; i < c->model->contacts; i++)
        if (strcmp(c->model->contact[i].name, name) == 0)
            return i;
    return OPSPACE_NO_TASK;
}

int opspace_contact_row(const opspace *c, int contact)
{
    for (int i = 0; i < c->touches; i++)
        if (c->touching[i] == contact)
            return i;
    return OPSPACE_NO_TASK;
}

int opspace_set_contact(opspace *c, int contact, int present, double duration, int wait)
{
    if (contact < 0 || contact >= c->model->contacts)
        return OPSPACE_NO_TASK;
    if (!isfinite(duration) || duration < 0.0)
        return OPSPACE_REFUSED;
    unsigned number;
    letter *letter = empty_letter(c, CONTACT_LETTER, contact, &number);
    if (!letter)
        return OPSPACE_BUSY;
    letter->x[0] = present ? 1.0 : 0.0;
    letter->x[1] = duration;
    letter->x[2] = wait ? 1.0 : 0.0;
    send(letter, number);
    return 0;
}

int opspace_set_presence(opspace *c, int task, int present, double t, double duration)
{
    if (!task_at(c, task))
        return OPSPACE_NO_TASK;
    if (!isfinite(t) || !isfinite(duration) || duration < 0.0)
        return OPSPACE_REFUSED;
    unsigned number;
    letter *letter = empty_letter(c, PRESENCE_LETTER, task, &number);
    if (!letter)
        return OPSPACE_BUSY;
    letter->x[0] = present ? 1.0 : 0.0;
    letter->x[1] = t;
    letter->x[2] = duration;
    send(letter, number);
    return 0;
}

static void open_letter(opspace *c, const letter *one)
{
    const double *x = one->x;
    const opspace_task *task = &c->model->task[one->about];
    switch (one->what) {
    case TARGET_LETTER:
        go_to(c, one->about, x);
        break;
    case GAINS_LETTER:
        copy(c->kp + task->first_row, x, task->rows);
        copy(c->kv + task->first_row, x + task->rows, task->rows);
        break;
    case FORCE_LETTER:
        copy(press_of(c, one->about) + PRESS_WANTED, x, task->rows);
        break;
    default:
        opspace_let_touch(c, one->about, x[0] != 0.0, x[1], x[2] != 0.0);
    }
}

/* Take what is asked for; a letter that is being written waits for the next step, and so does one with
 * a time where all that wait for theirs are too many. */
static void read_letters(opspace *c)
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

void opspace_restart(opspace *c)
{
    if (c->begun) {
        /* What was asked for until now comes after this step of the contacts, by the old clock. */
        opspace_move_contacts(c, 0.0);
        read_letters(c);
        c->paused = 1;
    }
    c->begun = 0;
    for (int i = 0; i < c->model->tasks; i++)
        c->kind[i * KIND_SIZE + KIND_REMEMBERS] = 0;
}

const double *opspace_read(const opspace *c, const char *name, int64_t *count)
{
    const opspace_field *one = find_field(c, name);
    if (!one || one->own)
        return NULL;
    if (count)
        *count = one->count;
    return (const double *)(c->words + one->first);
}
