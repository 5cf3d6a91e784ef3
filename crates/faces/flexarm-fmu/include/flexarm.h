/* C interface of flexarm: a robot arm with flexible links and elastic drives, stepped from outside.
 *
 * An arm has variables: parameters, inputs and outputs, found by name once and used by reference.
 * The names are those of the FMU (docs/fmu.md), for instance joint.joint_1.target_position,
 * tcp.position.x, tcp_error.length. All numbers are SI units and radians; truth values are 0 or 1.
 *
 * Functions that return int return 0, or -1 with a message in flexarm_error(). A plant may be used
 * by one thread at a time; different plants do not know of each other. Link with -lflexarm_fmu.
 */
#ifndef FLEXARM_H
#define FLEXARM_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct flexarm_plant flexarm_plant;
typedef struct flexarm_state_of flexarm_state_of;

/* FLEXARM_LOCAL: elastic coordinates, their velocities and accelerations. */
enum flexarm_causality_of {
    FLEXARM_TIME = 0, FLEXARM_PARAMETER = 1, FLEXARM_INPUT = 2, FLEXARM_OUTPUT = 3, FLEXARM_LOCAL = 4
};

/* Version of the library, such as "0.1.0". */
const char *flexarm_version(void);

/* Message of the last error in this thread, valid until the next call. */
const char *flexarm_error(void);

/* Loads a robot file (robot.toml) or URDF. Returns NULL on errors.
 *   links   "rigid", "lumped", "modal", or NULL: as the robot file says
 *   drives  "rigid", "elastic", "servo", or NULL: as the robot file says
 *   step_s  step size (s); 0 for the default
 *   pose    n_pose joint positions (rad or m) at the start; NULL and 0 for zero */
flexarm_plant *flexarm_open(const char *robot, const char *links, const char *drives, double step_s,
                            const double *pose, size_t n_pose);
void flexarm_free(flexarm_plant *plant);

/* Variables: number, reference by name (-1 if there is none), name, unit and causality by reference. */
size_t flexarm_count(const flexarm_plant *plant);
int flexarm_find(const flexarm_plant *plant, const char *name);
const char *flexarm_name(const flexarm_plant *plant, uint32_t reference);
const char *flexarm_unit(const flexarm_plant *plant, uint32_t reference);
int flexarm_causality(const flexarm_plant *plant, uint32_t reference);

/* Sets parameters (before the start) and inputs, reads any variables. */
int flexarm_set(flexarm_plant *plant, const uint32_t *references, const double *values, size_t n);
int flexarm_get(flexarm_plant *plant, const uint32_t *references, double *values, size_t n);

/* Starts at rest at the target positions, at time begin_s (s). */
int flexarm_start(flexarm_plant *plant, double begin_s);
/* Simulates length_s (s), a whole number of steps, with the inputs as they are. */
int flexarm_step(flexarm_plant *plant, double length_s);
/* Time (s). */
double flexarm_time(const flexarm_plant *plant);
/* Returns to the state after flexarm_open. */
int flexarm_reset(flexarm_plant *plant);

/* Copies the state of a started plant (NULL on errors), returns to it, frees it. What follows a
 * return has the same bits as before. A state is valid until its plant is reset or freed. */
flexarm_state_of *flexarm_state(flexarm_plant *plant);
int flexarm_restore(flexarm_plant *plant, const flexarm_state_of *state);
void flexarm_free_state(flexarm_state_of *state);

#ifdef __cplusplus
}
#endif
#endif
