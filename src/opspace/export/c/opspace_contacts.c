/* What a robot with a floating base touches, as opspace.stack.contact_course has it. */
#include "opspace_inside.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

int opspace_make_contacts(opspace *c)
{
    size_t count = (size_t)c->model->contacts;
    c->footing = calloc(count + 1, sizeof *c->footing);
    c->touching = calloc(count + 1, sizeof *c->touching);
    if (!c->footing || !c->touching)
        return 0;
    for (int i = 0; i < c->model->contacts; i++) {
        footing *one = &c->footing[i];
        one->pace = one->calm = one->highest = 1.0;
        one->there = c->model->contact[i].there;
        one->progress = one->target = one->there;
        if (one->there)
            c->touching[c->touches++] = i;
    }
    return 1;
}

/* Move a contact on by so many seconds. One that goes waits where what it gives up is what it may. */
static void advance(footing *one, double passed, double hindrance)
{
    double step = one->duration == 0.0 ? INFINITY : passed / one->duration;
    one->waiting = 0;
    if (one->target > one->progress) {
        one->progress = fmin(one->target, one->progress + step);
    } else if (one->target < one->progress) {
        int waits = one->waits && one->duration > 0.0;
        double pace = waits ? 1.0 - fmin(CONTACT_STOP, hindrance) : 1.0;
        one->waiting = pace < 0.5;
        double calm = one->calm
            * (pace * one->pace < 0.0 ? CONTACT_CALMER : 1.0 + passed / CONTACT_RECOVERY);
        one->calm = fmin(1.0, fmax(CONTACT_CALMEST, calm));
        one->pace = pace;
        double moved = one->progress - one->calm * pace * step;
        one->progress = fmin(one->highest, fmax(one->target, moved));
    }
}

/* Write those that are there, in their order, where the kernels read them. */
static void pack(opspace *c)
{
    int first = 0;
    for (int i = 0; i < c->touches; i++) {
        const opspace_contact *one = &c->model->contact[c->touching[i]];
        int64_t *place = c->stance.place + i * CONTACT_PLACE_SIZE;
        const double *x = one->numbers;
        place[0] = one->body;
        place[1] = one->joint;
        place[2] = one->rows;
        place[3] = first;
        c->stance.edges[i] = one->edges;
        c->stance.most[i] = one->most;
        memcpy(c->stance.numbers + i * CONTACT_NUMBERS_SIZE, x, CONTACT_NUMBERS_SIZE * sizeof *x);
        x += CONTACT_NUMBERS_SIZE;
        memcpy(c->stance.cone + i * CONTACT_CONE_SIZE, x, CONTACT_CONE_SIZE * sizeof *x);
        x += CONTACT_CONE_SIZE;
        memcpy(c->stance.metric + first, x, (size_t)one->rows * sizeof *x);
        x += one->rows;
        memcpy(c->stance.reference + first, x, (size_t)one->rows * sizeof *x);
        first += one->rows;
    }
    *c->stance.count = c->touches;
    *c->stance.rows = first;
}

void opspace_let_touch(opspace *c, int contact, int present, double duration, int waits)
{
    footing *one = &c->footing[contact];
    if (!one->there) {
        if (!present)
            return;
        one->there = 1;
        one->progress = 0.0;
        c->touching[c->touches++] = contact;
    }
    one->target = present;
    one->duration = duration;
    one->waits = waits;
    one->highest = one->progress;
    one->pace = one->calm = 1.0;
    advance(one, 0.0, 0.0);
}

/* Forget those that are gone. */
static void drop(opspace *c)
{
    int kept = 0;
    for (int i = 0; i < c->touches; i++) {
        footing *one = &c->footing[c->touching[i]];
        if (one->progress == 0.0 && one->target == 0.0)
            one->there = 0;
        else
            c->touching[kept++] = c->touching[i];
    }
    c->touches = kept;
}

void opspace_move_contacts(opspace *c, double passed)
{
    for (int i = 0; i < c->touches; i++)
        advance(&c->footing[c->touching[i]], passed, c->hindrance);
}

int64_t opspace_touch(opspace *c)
{
    int64_t waits = 0;
    drop(c);
    pack(c);
    for (int i = 0; i < c->touches; i++) {
        const footing *one = &c->footing[c->touching[i]];
        double motion = one->progress / CONTACT_MOTION_PART;
        double force = (one->progress - CONTACT_MOTION_PART) / (1.0 - CONTACT_MOTION_PART);
        int whole = motion >= 1.0 && force >= 1.0, profile = c->model->profile;
        c->stance.motion[i] = whole ? 1.0 : opspace_profile(profile, fmin(1.0, motion));
        c->stance.force[i] = whole ? 1.0 : opspace_profile(profile, fmin(1.0, fmax(0.0, force)));
        if (one->waiting)
            waits = OPSPACE_CONTACT_WAITS;
    }
    return waits;
}
