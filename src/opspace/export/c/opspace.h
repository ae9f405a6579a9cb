/* An exported controller of opspace: from time and state to torque, without Python.
 *
 * Link the sources of the library, the file of the controller, the kernels and the mathematics library
 * (-lm). Nothing here locks, and only opspace_open allocates. Targets, gains, forces, levels and what
 * comes and goes may be asked for from any thread at any time, and neither that thread nor the step
 * waits; everything else is for the thread that steps. Different controllers, also of one model, are
 * independent. Units are SI and radians, rotations 3 x 3 by rows.
 */
#ifndef OPSPACE_H
#define OPSPACE_H

#include <stddef.h>
#include <stdint.h>

#include "opspace_codes.h"

#ifdef __cplusplus
extern "C" {
#endif

/* A task, as it was exported. */
typedef struct {
    const char *name;
    int first_row; /* of its rows among those of all tasks */
    int rows;
    int position;    /* numbers of a target: a position first, */
    int orientation; /* then a rotation; */
    int joints;      /* or joint positions */
    int level;       /* where it is at first, a place in the levels of the model */
    int led;         /* whether it goes to targets on ways */
    int graded;      /* whether a new force brings other thresholds of its contact */
} opspace_task;

/* A contact, as it was exported. */
typedef struct {
    const char *name;
    int there; /* at first */
    int rows;
    int body;
    int joint;
    int edges;   /* of its cone */
    double most; /* largest normal force, N */
    const double *numbers;
} opspace_contact;

/* When a robot that stands is given up. */
typedef struct {
    double after;  /* s, not balanced without getting better */
    double cosine; /* of how far its base may turn */
    double upright[3];
} opspace_fall;

/* An array that can be read. */
typedef struct {
    const char *name;
    int64_t first; /* word where it begins */
    int64_t count;
    int own; /* only the library reads it */
} opspace_field;

typedef struct {
    int64_t first;
    int64_t count;
} opspace_run;

/* An exported controller as data; its source defines one under its own name. */
typedef struct {
    const char *stamp; /* of the kernels that it was made for, and of this structure */
    int n;             /* joints */
    int nq;            /* coordinates of a configuration */
    int tasks;
    const char *const *joint; /* names, in the order of v and tau */
    const opspace_task *task;
    int moves;   /* changes of place that can be on their way at once */
    int profile; /* of all transitions */
    int levels;
    const double *level; /* their numbers, the most important first */
    int base;            /* coordinates without a motor */
    int quaternions;
    const int *quaternion; /* first coordinate of each */
    int contacts;
    const opspace_contact *contact;
    const opspace_fall *fall; /* NULL is never */
    int fields;
    const opspace_field *field;
    double period; /* s, between two steps; 0 where none was announced */
    int robot_adds;    /* whether the robot adds the torque against gravity */
    int64_t words; /* of its memory */
    int64_t handle;
    int64_t integrals; /* what integral action remembers; -1 where no task has any */
    int64_t runs; /* pieces of it that are not zero, */
    const opspace_run *run;
    const uint64_t *content; /* what they hold, one after the other, */
    int64_t addresses;
    const int64_t *address; /* and which words hold the place of another one */
    uint64_t *memory;       /* where kernels of its own have it; NULL is anywhere */
} opspace_model;

typedef struct opspace opspace;

/* Make a controller that has not ticked yet.
 *
 * NULL where there is no memory, or where the kernels are not those that the model was made for; with
 * kernels of its own also as long as there is another one. */
opspace *opspace_open(const opspace_model *model);

/* Give its memory back; NULL is none. */
void opspace_close(opspace *controller);

/* Compute the torque tau (n) for the state q (nq), v (n) at time t.
 *
 * Where the robot adds the torque against gravity, tau is what it adds that to.
 * Returns what happened, a sum of OPSPACE_ statuses, 0 in an ordinary tick. With OPSPACE_FAULT tau is
 * the torque against the bias with joint damping. With OPSPACE_FALLING the robot is given up and its
 * joints are damped, until opspace_restart. OPSPACE_NOT_FINITE, negative: time or state is not
 * finite or a quaternion has no direction, and tau is as it was; nor does it change with
 * OPSPACE_NO_WRENCH, a force task that has never been given one. */
int64_t opspace_step(opspace *controller, double t, const double *q, const double *v, double *tau);

/* Number of a task, or OPSPACE_NO_TASK. */
int opspace_find_task(const opspace *controller, const char *name);

/* Send a task to a target, from the next step on.
 *
 * x is a position (3), then a rotation (9), or joint positions, as the task has them; velocity and
 * acceleration are 3 numbers for each of position and rotation, or one for each joint, NULL for zero.
 * A task that was exported with a max_acceleration goes there on a way, from what it follows then, within
 * its speed and acceleration; with a velocity that is not zero the target is followed as it is. A target
 * told again is the same way. Returns 0, OPSPACE_NO_TASK or OPSPACE_REFUSED: a number is not finite, or x
 * holds no rotation; or OPSPACE_BUSY, as everything that may be asked from any thread: 64 wishes wait for
 * the next step, or for times of their own. */
int opspace_set_target(
    opspace *controller, int task, const double *x, const double *velocity,
    const double *acceleration);

/* Change the gains of a task: kp in 1/s^2 and kv in 1/s, one for each of its rows.
 *
 * A force task has no kp, and its kv is at least twice its integral gain; kp kv of a task with ki stays
 * above it. Returns 0, OPSPACE_NO_TASK or
 * OPSPACE_REFUSED: a gain is negative or not finite, or is no force task's. */
int opspace_set_gains(opspace *controller, int task, const double *kp, const double *kv);

/* Give a force task the wrench that the robot exerts on the environment, measured at time t; from the
 * thread that steps.
 *
 * wrench is 3 N and 3 N*m in world axes at the point of the task. No step is made before every force
 * task has had one; after 10 ms without a new one the status says OPSPACE_WRENCH_STALE. Returns 0,
 * OPSPACE_NO_TASK or OPSPACE_REFUSED: no force task, or a number that is not finite. */
int opspace_set_wrench(opspace *controller, int task, double t, const double *wrench);

/* Change what a force task presses with, one number for each of its rows, N then N*m.
 *
 * It is approached at the rate that the task was exported with. Returns 0, OPSPACE_NO_TASK or
 * OPSPACE_REFUSED: no force task, a number is not finite, the force is zero, or it is below the one at
 * which a task with a contact of its own is sure of it; one without has a tenth and four tenths. */
int opspace_set_force(opspace *controller, int task, const double *force);

/* Let a task come (present is 1) or go (0) from time t on, for so many seconds.
 *
 * It waits for a time that is to come, and begins with the next step where t is not after the step
 * before, so that nobody who asks late asks for a step in the torque. A task on its way turns. The torque
 * follows as smoothly as the profile that the task was exported with. Returns 0, OPSPACE_NO_TASK or
 * OPSPACE_REFUSED. */
int opspace_set_presence(opspace *controller, int task, int present, double t, double duration);

/* Move a task to another level from time t on, within so many seconds; it is never absent on the way.
 *
 * level is the number of one that the model was exported with; a task that is not there is at it at once.
 * Asked again on the way it turns without a step. Times are those of opspace_set_presence. Returns 0,
 * OPSPACE_NO_TASK or OPSPACE_REFUSED; or OPSPACE_BUSY: as many tasks are on their way to other levels,
 * or wait for their time, as the model was exported for, and one has to arrive first. To turn takes the
 * room of one, too, until it has begun. */
int opspace_move(opspace *controller, int task, double level, double t, double duration);

/* Exchange the levels of two tasks, as opspace_move; asked again on the way, it is turned around. */
int opspace_swap(opspace *controller, int first, int second, double t, double duration);

/* Number of a contact, or OPSPACE_NO_TASK. */
int opspace_find_contact(const opspace *controller, const char *name);

/* Let a contact come (present is 1) or go (0) from the next step on.
 *
 * One that goes waits for what the others can carry, or, where wait is 0, for nothing; so does a
 * duration of 0. The robot must touch when it comes. Returns 0, OPSPACE_NO_TASK or OPSPACE_REFUSED. */
int opspace_set_contact(opspace *controller, int contact, int present, double duration, int wait);

/* Row of a contact in what opspace_read tells about contacts, or OPSPACE_NO_TASK while it is not
 * there; for the thread that steps. */
int opspace_contact_row(const opspace *controller, int contact);

/* Multiply the presence of a task by an activation of one's own, from 0 to 1; from the thread that
 * steps.
 *
 * It is the caller's to change it smoothly. Returns 0, OPSPACE_NO_TASK or OPSPACE_REFUSED. */
int opspace_set_activation(opspace *controller, int task, double activation);

/* Let time go on from anywhere at the next step; angles take the short way, no task has been at rest, and
 * ways to targets begin anew where the robot is found. Tasks on their way go on from where they were, and
 * what waits for its time waits on; times that are given from now on are those
 * of the clock after the pause. From the thread that steps. */
void opspace_restart(opspace *controller);

/* What the last step left, by a name of opspace_codes.h; NULL if there is none of that name.
 *
 * Count, if not NULL, becomes how many numbers it has. */
const double *opspace_read(const opspace *controller, const char *name, int64_t *count);

#ifdef __cplusplus
}
#endif

#endif
