/* At which level tasks are, and how they move between levels, as opspace.stack has it. */
#include "opspace_inside.h"

#include <stdlib.h>
#include <string.h>

/* Columns of a ramp that are read here. */
enum { TARGET = 1, START = 2 };
enum { SLOT_DEPTH, SLOT_FIRST, SLOT_ROWS, SLOT_SIZE };

/* A bit that no activation has. */
#define NEVER ((int64_t)1 << 62)

static int most_places(const opspace *c)
{
    return 1 + c->model->moves;
}

static place *places_of(const opspace *c, int task)
{
    return c->place + task * most_places(c);
}

int opspace_make_places(opspace *c)
{
    const opspace_model *m = c->model;
    size_t tasks = (size_t)m->tasks + 1, changes = (size_t)m->moves + 1;
    c->place = calloc(tasks * (size_t)most_places(c), sizeof *c->place);
    c->places = calloc(tasks, sizeof *c->places);
    c->change = calloc(changes, sizeof *c->change);
    if (!c->place || !c->places || !c->change)
        return 0;
    for (int i = 0; i < m->tasks; i++) {
        c->places[i] = 1;
        places_of(c, i)[0].level = m->task[i].level;
        places_of(c, i)[0].change = -1;
    }
    c->room = m->moves;
    return 1;
}

/* --- What the kernels read ------------------------------------------------------------------- */

/* Give every change the place among the activations that it has in Python: after the presences, in
 * the order of the tasks. */
static void number_changes(opspace *c)
{
    const opspace_model *m = c->model;
    int next = m->tasks;
    for (int k = 0; k < m->moves; k++) {
        change *x = &c->change[k];
        x->group = x->variable < m->tasks ? GROUP_NONE : c->group[x->variable];
        x->variable = -1;
    }
    for (int i = 0; i < m->tasks; i++)
        for (int k = 1; k < c->places[i]; k++) {
            change *x = &c->change[places_of(c, i)[k].change];
            if (x->variable < 0)
                x->variable = next++;
        }
    for (int v = m->tasks; v < m->tasks + m->moves; v++) {
        opspace_rest(c->variable + v * VARIABLE_SIZE, m->profile, 0.0);
        c->group[v] = GROUP_NONE;
    }
    for (int k = 0; k < m->moves; k++) {
        const change *x = &c->change[k];
        if (x->variable < 0)
            continue;
        memcpy(c->variable + x->variable * VARIABLE_SIZE, x->ramp, sizeof x->ramp);
        c->group[x->variable] = x->group;
    }
}

static int64_t bit_of(const opspace *c, const place *one)
{
    return one->change < 0 ? 0 : (int64_t)1 << c->change[one->change].variable;
}

static void write_slot(opspace *c, int slot, int task, int k)
{
    const opspace_task *one = &c->model->task[task];
    const place *places = places_of(c, task);
    int64_t *row = c->slots + slot * SLOT_SIZE, off = 0;
    row[SLOT_DEPTH] = places[k].level + 1;
    row[SLOT_FIRST] = one->first_row;
    row[SLOT_ROWS] = one->rows;
    for (int later = k + 1; later < c->places[task]; later++)
        off |= bit_of(c, &places[later]);
    c->slot_place[slot] = bit_of(c, &places[k]);
    c->slot_on[slot] = c->slot_place[slot] | (int64_t)1 << task;
    c->slot_off[slot] = off;
}

static int write_slots(opspace *c)
{
    const opspace_model *m = c->model;
    int slot = 0;
    for (int level = 0; level < m->levels; level++)
        for (int i = 0; i < m->tasks; i++)
            for (int k = 0; k < c->places[i]; k++)
                if (places_of(c, i)[k].level == level)
                    write_slot(c, slot++, i, k);
    return slot;
}

void opspace_pack_places(opspace *c)
{
    const opspace_model *m = c->model;
    int all = m->tasks + 2 * m->moves;
    number_changes(c);
    for (int slot = write_slots(c); slot < all; slot++) {
        memset(c->slots + slot * SLOT_SIZE, 0, SLOT_SIZE * sizeof *c->slots);
        c->slot_on[slot] = c->slot_place[slot] = NEVER;
        c->slot_off[slot] = 0;
    }
    for (int depth = 0; depth < m->levels + 2; depth++) {
        c->first_kept[depth] = 0;
        for (int slot = 0; slot < all; slot++)
            if (c->slots[slot * SLOT_SIZE + SLOT_DEPTH] < depth)
                c->first_kept[depth] += c->slots[slot * SLOT_SIZE + SLOT_ROWS];
    }
}

/* --- Changes ------------------------------------------------------------------------------------ */

static change *change_of(const opspace *c, int task, int k)
{
    int found = places_of(c, task)[k].change;
    return found < 0 ? NULL : &c->change[found];
}

/* Somebody has asked for one that is not needed after all, or not any more. */
static void give_back(opspace *c)
{
    __atomic_fetch_add(&c->room, 1, __ATOMIC_RELEASE);
}

static void forget_place(opspace *c, int task, int k)
{
    change *x = change_of(c, task, k);
    if (x && --x->places == 0)
        give_back(c);
}

/* Begin a change at time t; there is one, since whoever asked has taken it. */
static int begin(opspace *c, int shared, double t, double duration)
{
    int k = 0;
    while (c->change[k].places)
        k++;
    change *x = &c->change[k];
    x->shared = shared;
    x->variable = -1;
    opspace_rest(x->ramp, c->model->profile, 0.0);
    opspace_send(x->ramp, 1.0, t, duration);
    return k;
}

static void add_place(opspace *c, int task, int level, int k)
{
    place *one = &places_of(c, task)[c->places[task]++];
    one->level = level;
    one->change = k;
    c->change[k].places++;
}

/* Forget the places that a task has left or will not come to. */
static int tidy(opspace *c, int task, double t)
{
    place *places = places_of(c, task);
    int before = c->places[task], kept = 0;
    for (int k = 0; k < before; k++) {
        const change *x = change_of(c, task, k);
        if (!x || !opspace_arrived(x->ramp, t)) {
            places[kept++] = places[k];
            continue;
        }
        if (x->ramp[TARGET] == 1.0) {
            int level = places[k].level;
            for (int i = 0; i < kept; i++)
                forget_place(c, task, i);
            forget_place(c, task, k);
            places[0].level = level;
            places[0].change = -1;
            kept = 1;
        } else {
            forget_place(c, task, k);
        }
    }
    c->places[task] = kept;
    return kept < before;
}

void opspace_tidy_places(opspace *c, double t)
{
    int changed = 0;
    for (int i = 0; i < c->model->tasks; i++)
        if (c->places[i] > 1)
            changed |= tidy(c, i, t);
    if (changed)
        opspace_pack_places(c);
}

/* Make a place the goal by turning changes, unless another task depends on them. */
static int turn(opspace *c, int task, int goal, double t, double duration)
{
    for (int k = goal; k < c->places[task]; k++) {
        const change *x = change_of(c, task, k);
        if (x && x->shared && x->ramp[TARGET] != (k == goal))
            return 0;
    }
    for (int k = goal; k < c->places[task]; k++) {
        change *x = change_of(c, task, k);
        if (x && !x->shared)
            opspace_send(x->ramp, k == goal, t, duration);
    }
    return 1;
}

/* Whether a change only begins at time t, has had no effect and may be forgotten. */
static int idle(const change *x, double t)
{
    return !x->shared && t <= x->ramp[START] && opspace_activation(x->ramp, t) == 0.0;
}

static int absent(const opspace *c, int task, double t)
{
    const double *presence = c->variable + task * VARIABLE_SIZE;
    return presence[TARGET] == 0.0 && opspace_arrived(presence, t);
}

/* Put a task that is not there at a level at once. */
static void put(opspace *c, int task, int level)
{
    for (int k = 1; k < c->places[task]; k++)
        forget_place(c, task, k);
    c->places[task] = 1;
    places_of(c, task)[0].level = level;
}

static void move(opspace *c, int task, int level, double t, double duration)
{
    if (absent(c, task, t)) {
        put(c, task, level);
        give_back(c);
        return;
    }
    for (int k = c->places[task] - 1; k >= 0; k--)
        if (places_of(c, task)[k].level == level && turn(c, task, k, t, duration)) {
            give_back(c);
            return;
        }
    for (const change *x; (x = change_of(c, task, c->places[task] - 1)) && idle(x, t);)
        forget_place(c, task, --c->places[task]);
    add_place(c, task, level, begin(c, 0, t, duration));
}

void opspace_let_move(opspace *c, int task, int level, double t, double duration)
{
    move(c, task, level, t, duration);
    opspace_pack_places(c);
}

/* Where a task will be when everything has arrived. */
static int goal_level(const opspace *c, int task)
{
    int level = places_of(c, task)[0].level;
    for (int k = 1; k < c->places[task]; k++)
        if (change_of(c, task, k)->ramp[TARGET] == 1.0)
            level = places_of(c, task)[k].level;
    return level;
}

static void swap(opspace *c, int first, int second, double t, double duration)
{
    change *common = change_of(c, first, c->places[first] - 1);
    int here = goal_level(c, first), there = goal_level(c, second);
    int turns = common && common->shared && common == change_of(c, second, c->places[second] - 1);
    if (turns)
        opspace_send(common->ramp, 1.0 - common->ramp[TARGET], t, duration);
    if (turns || here == there) {
        give_back(c);
        return;
    }
    int k = begin(c, 1, t, duration);
    add_place(c, first, there, k);
    add_place(c, second, here, k);
}

void opspace_let_swap(opspace *c, int first, int second, double t, double duration)
{
    swap(c, first, second, t, duration);
    opspace_pack_places(c);
}
