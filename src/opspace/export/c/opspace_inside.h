/* What the sources of the library share; see opspace.h for what programs use. */
#ifndef OPSPACE_INSIDE_H
#define OPSPACE_INSIDE_H

#include "opspace.h"
#include "opspace_layout.h"

/* Joined sums would round otherwise than in Python. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC optimize("fp-contract=off")
#endif

/* What is asked for between two steps, from any thread: a ring of letters. Whoever writes one takes a
 * number, which is the only thing that writers share, and says by it that the letter is there; the step
 * takes letters in order up to the first that is not. Nobody waits for anybody. */
enum { LETTERS = 64 };
enum {
    TARGET_LETTER,
    GAINS_LETTER,
    FORCE_LETTER,
    PRESENCE_LETTER,
    MOVE_LETTER,
    SWAP_LETTER,
    CONTACT_LETTER
};

typedef struct {
    unsigned turn; /* the number of its writer while it is empty, one more while it is full */
    int what;
    int about; /* a task, or a contact */
    double *x;
} letter;

/* A letter that waits for its time. */
typedef struct {
    int what;
    int about;
    double order;
    double x[3];
} wish;

/* A level at which a task is, or to which it is on its way. */
typedef struct {
    int level;  /* place in the table of levels */
    int change; /* what brings it here; -1 of the first place */
} place;

/* A change of place in time; a swap has one for both tasks. */
typedef struct {
    int places; /* that it leads to; 0 is a free one */
    int shared;
    int variable; /* where the kernels have it; -1 is nowhere yet */
    int64_t group;
    double ramp[VARIABLE_SIZE];
} change;

/* How far a contact has come. */
typedef struct {
    int there;   /* whether it has come, or is on its way */
    int waits;   /* a removal, for what the others can carry */
    int waiting; /* now */
    double progress, target, duration, highest, pace, calm;
} footing;

struct opspace {
    const opspace_model *model;
    void *block;
    uint64_t *words;
    void *handle;
    double *q, *v, *tau, *M, *bias, *torque_limit, *torque_middle, *option;
    double *gravity, *variable, *own, *numbers, *goal, *kp, *kv, *press, *row_unrest, *unrest_at;
    int64_t *kind, *endless, *group, *first_kept, *slots, *slot_on, *slot_off, *slot_place;
    double *state, *last;
    double before;
    int begun, carried, paused;
    uint64_t heard; /* tasks that have been told a wrench since the last restart, a bit each */
    letter ring[LETTERS];
    double *paper;
    unsigned written, taken;
    wish later[LETTERS]; /* in the order of their times */
    int timed;
    /* Where tasks are: places of each, one after the other, and the changes between them. */
    place *place;
    int *places;
    change *change;
    int room; /* changes that nobody has asked for */
    /* What it touches: those that are there, in the order in which they came. */
    footing *footing;
    int *touching;
    int touches;
    double hindrance;
    struct {
        int hopeless, fell;
        double since, fell_at, fastest, most;
        double *last; /* torque of the last step in which it stood */
    } fall;
    struct {
        double *ki, *motion, *joint, *since;
        double *ahead; /* accelerations without them: 6 of each task, then those of joints */
        double before;
        int begun;
    } sums;
    struct {
        double *asked_goal, *joint_asked, *more, *joint_more;
        int64_t *asked, *on;
        double *told; /* what each task is told, and what it was told before */
        int *fresh, *known; /* whether it has not been looked at; whether the task follows anything yet */
        int size;
    } ways;
    struct {
        int64_t *count, *rows, *place, *edges;
        double *numbers, *motion, *force, *most, *cone, *metric, *reference, *hindrance;
    } stance;
};

/* opspace.c: tasks, and numbers. */
const opspace_task *opspace_task_at(const opspace *c, int task);
double *opspace_press_of(const opspace *c, int task);
void opspace_forget_touch(opspace *c, int task);
int opspace_all_finite(const double *x, int count);
void opspace_copy(double *to, const double *from, int count);

/* opspace_wishes.c: letters. */
int opspace_make_ring(opspace *c);
void opspace_read_letters(opspace *c);
int opspace_speeds_of(const opspace_task *one);
void opspace_go_to(opspace *c, int task, const double *x);

/* opspace_ways.c: ways to targets. */
int opspace_make_ways(opspace *c);
void opspace_begin_ways(opspace *c);
void opspace_tell_way(opspace *c, int task, const double *x);
void opspace_forget_way(opspace *c, int task);
int opspace_is_led(const opspace *c, int task);
void opspace_lead(opspace *c);

/* opspace_ramps.c: activations in time. */
double opspace_profile(int code, double s);
int opspace_arrived(const double *ramp, double t);
double opspace_activation(const double *ramp, double t);
void opspace_rest(double *ramp, double profile, double target);
void opspace_send(double *ramp, double target, double t, double duration);

/* opspace_integrals.c: what is left of errors. */
int opspace_make_integrals(opspace *c);
void opspace_note_acceleration(opspace *c, int task);
void opspace_push_integrals(opspace *c);
void opspace_learn_errors(opspace *c, double t, int64_t status);
void opspace_forget_integral(opspace *c, int task);

/* opspace_places.c: at which level tasks are. */
int opspace_make_places(opspace *c);
void opspace_pack_places(opspace *c);
void opspace_let_move(opspace *c, int task, int level, double t, double duration);
void opspace_let_swap(opspace *c, int first, int second, double t, double duration);
void opspace_tidy_places(opspace *c, double t);

/* opspace_timed.c: what starts at a time of its own. */
int opspace_has_time(int what);
int opspace_let_wait(opspace *c, const letter *asked);
void opspace_start_timed(opspace *c, double t);
void opspace_pause(opspace *c, double pause);

/* opspace_contacts.c: what a robot with a floating base touches. */
int opspace_make_contacts(opspace *c);
void opspace_let_touch(opspace *c, int contact, int present, double duration, int waits);
void opspace_move_contacts(opspace *c, double passed);
int64_t opspace_touch(opspace *c);

/* opspace_falling.c: when it is given up. */
int opspace_make_fall(opspace *c);
void opspace_forget_fall(opspace *c);
int64_t opspace_watch_fall(opspace *c, double t, int64_t status, double *tau);

#endif
