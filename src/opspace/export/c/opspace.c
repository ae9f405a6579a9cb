/* An exported controller: its memory, its step, and what belongs to the thread that steps; see
 * opspace.h. */
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
    c->row_unrest = memory_of(c, "row_unrest");
    c->unrest_at = memory_of(c, "unrest_at");
    c->slots = memory_of(c, "slots");
    c->slot_on = memory_of(c, "slot_on");
    c->slot_off = memory_of(c, "slot_off");
    c->slot_place = memory_of(c, "slot_place");
    c->first_kept = memory_of(c, "space.first_kept");
    c->ways.asked_goal = memory_of(c, "led.asked_goal");
    c->ways.joint_asked = memory_of(c, "led.joint_asked");
    c->ways.more = memory_of(c, "led.more");
    c->ways.joint_more = memory_of(c, "led.joint_more");
    c->ways.asked = memory_of(c, "led.asked");
    c->ways.on = memory_of(c, "led.on");
    c->sums.ki = memory_of(c, "integrals.ki");
    c->sums.motion = memory_of(c, "integrals.integral");
    c->sums.joint = memory_of(c, "integrals.joint_integral");
    c->sums.since = memory_of(c, "integrals.since");
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

/* Whether kernels and models are what they were when the model was written. */
static int made_for_these_kernels(const char *stamp)
{
    size_t kernels = strlen(opspace_stamp);
    return strncmp(stamp, opspace_stamp, kernels) == 0
        && strcmp(stamp + kernels, "-" OPSPACE_MODEL_FORM) == 0;
}

/* Bytes of a line of the cache: a vector that does not lie across two of them is read at once. */
enum { LINE = 64 };

/* Whether the memory of kernels of one's own is in use. */
static int taken;

static uint64_t *take_memory(opspace *c)
{
    const opspace_model *m = c->model;
    size_t size = (size_t)m->words * sizeof *m->memory;
    if (!m->memory) {
        c->block = calloc(1, size + LINE);
        if (!c->block)
            return NULL;
        return (uint64_t *)((char *)c->block + (LINE - (uintptr_t)c->block % LINE));
    }
    if (__atomic_exchange_n(&taken, 1, __ATOMIC_ACQUIRE))
        return NULL;
    return memset(m->memory, 0, size);
}

static void give_memory_back(opspace *c)
{
    if (c->words && c->words == c->model->memory)
        __atomic_store_n(&taken, 0, __ATOMIC_RELEASE);
    free(c->block);
}

opspace *opspace_open(const opspace_model *model)
{
    if (!model || !made_for_these_kernels(model->stamp))
        return NULL;
    opspace *c = calloc(1, sizeof *c);
    if (!c)
        return NULL;
    c->model = model;
    c->words = take_memory(c);
    c->state = calloc((size_t)(model->nq + model->n), sizeof *c->state);
    if (!c->words || !c->state || !opspace_make_ring(c) || !opspace_make_places(c)
        || !opspace_make_contacts(c) || !opspace_make_fall(c) || !opspace_make_integrals(c)
        || !opspace_make_ways(c)) {
        opspace_close(c);
        return NULL;
    }
    c->last = c->state + model->nq;
    lay_out(c);
    find_fields(c);
    for (int i = 0; i < model->tasks; i++)
        opspace_note_acceleration(c, i);
    opspace_begin_ways(c);
    opspace_pack_places(c);
    return c;
}

void opspace_close(opspace *c)
{
    if (c) {
        give_memory_back(c);
        free(c->paper);
        free(c->state);
        free(c->place);
        free(c->places);
        free(c->change);
        free(c->footing);
        free(c->touching);
        free(c->sums.ahead);
        free(c->ways.told);
        free(c->ways.fresh);
        free(c->fall.last);
    }
    free(c);
}

int opspace_all_finite(const double *x, int count)
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
double *opspace_press_of(const opspace *c, int task)
{
    const int64_t *kind = c->kind + task * KIND_SIZE;
    return kind[KIND_KIND] == KIND_FORCE ? c->press + kind[KIND_PRESS] * PRESS_SIZE : NULL;
}

/* A force task that comes anew begins without contact. */
void opspace_forget_touch(opspace *c, int task)
{
    double *row = opspace_press_of(c, task);
    if (row) {
        row[PRESS_BEGUN] = row[PRESS_CONFIDENCE] = 0.0;
        row[PRESS_FLOOR] = INFINITY;
    }
}

/* After a tick that has not come as it should, integrals of forces stay what they are for one more. */
static void freeze_forces(opspace *c)
{
    for (int i = 0; i < c->model->tasks; i++) {
        double *row = opspace_press_of(c, i);
        if (row)
            row[PRESS_FROZEN] = 1.0;
    }
}

static int all_measured(const opspace *c)
{
    for (int i = 0; i < c->model->tasks; i++) {
        const double *row = opspace_press_of(c, i);
        if (row && !isfinite(row[PRESS_GIVEN_AT]))
            return 0;
    }
    return 1;
}

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

static int64_t answered(opspace *c, double t, int64_t found, int64_t answer, double *tau)
{
    const opspace_model *m = c->model;
    if (answer < 0) {
        brake(c, tau);
        without_gravity(c, tau);
        return found | OPSPACE_FAULT;
    }
    int64_t status = found | answer % ANSWER_SOLVE;
    if (found & ~(int64_t)(OPSPACE_DIRECTION_OFF | OPSPACE_LATE))
        freeze_forces(c);
    opspace_learn_errors(c, t, status);
    memcpy(tau, c->tau, (size_t)m->n * sizeof *tau);
    without_gravity(c, tau);
    if (m->base > 0) {
        c->hindrance = *c->stance.hindrance;
        status |= opspace_watch_fall(c, t, status, tau);
        memcpy(c->last, tau, (size_t)m->n * sizeof *tau);
        c->carried = 1;
    }
    return status;
}

int64_t opspace_step(opspace *c, double t, const double *q, const double *v, double *tau)
{
    const opspace_model *m = c->model;
    if (!isfinite(t) || !opspace_all_finite(q, m->nq) || !opspace_all_finite(v, m->n))
        return OPSPACE_NOT_FINITE;
    memcpy(c->state, q, (size_t)m->nq * sizeof *q);
    if (!normalise(c, c->state))
        return OPSPACE_NOT_FINITE;
    if (!all_measured(c)) {
        opspace_read_letters(c);
        return OPSPACE_NO_WRENCH;
    }
    if (c->paused)
        opspace_pause(c, t - c->before);
    else
        opspace_move_contacts(c, c->begun ? fmax(0.0, t - c->before) : 0.0);
    c->paused = 0;
    opspace_read_letters(c);
    opspace_start_timed(c, t);
    int64_t found = watch(c, t, c->state, v);
    c->before = t;
    c->begun = 1;
    memcpy(c->q, c->state, (size_t)m->nq * sizeof *q);
    memcpy(c->v, v, (size_t)m->n * sizeof *v);
    if (m->base > 0)
        found |= opspace_touch(c);
    opspace_lead(c);
    opspace_push_integrals(c);
    int64_t answer = opspace_tick(t, c->handle);
    return answered(c, t, found, answer, tau);
}

int opspace_find_task(const opspace *c, const char *name)
{
    for (int i = 0; i < c->model->tasks; i++)
        if (strcmp(c->model->task[i].name, name) == 0)
            return i;
    return OPSPACE_NO_TASK;
}

const opspace_task *opspace_task_at(const opspace *c, int task)
{
    return task < 0 || task >= c->model->tasks ? NULL : &c->model->task[task];
}

void opspace_copy(double *to, const double *from, int count)
{
    for (int i = 0; i < count; i++)
        to[i] = from ? from[i] : 0.0;
}

int opspace_set_wrench(opspace *c, int task, double t, const double *wrench)
{
    if (!opspace_task_at(c, task))
        return OPSPACE_NO_TASK;
    double *row = opspace_press_of(c, task);
    if (!row || !isfinite(t) || !opspace_all_finite(wrench, 6))
        return OPSPACE_REFUSED;
    opspace_copy(row + PRESS_GIVEN, wrench, 6);
    row[PRESS_GIVEN_AT] = t;
    c->heard |= (uint64_t)1 << task;
    return 0;
}

int opspace_set_activation(opspace *c, int task, double activation)
{
    if (!opspace_task_at(c, task))
        return OPSPACE_NO_TASK;
    if (!(activation >= 0.0 && activation <= 1.0))
        return OPSPACE_REFUSED;
    c->own[task] = activation;
    return 0;
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

void opspace_restart(opspace *c)
{
    if (c->begun) {
        /* What was asked for until now comes after this step of the contacts, by the old clock. */
        opspace_move_contacts(c, 0.0);
        opspace_read_letters(c);
        c->paused = 1;
        c->heard = 0;
    }
    c->begun = 0;
    opspace_forget_fall(c);
    for (int i = 0; i < c->model->tasks; i++) {
        c->kind[i * KIND_SIZE + KIND_REMEMBERS] = 0;
        opspace_forget_way(c, i);
    }
    /* No task has been at rest. */
    const opspace_task *last = c->model->task + c->model->tasks - 1;
    for (int row = 0; c->model->tasks > 0 && row < last->first_row + last->rows; row++)
        c->row_unrest[row] = MOST_UNREST;
    *c->unrest_at = INFINITY;
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
