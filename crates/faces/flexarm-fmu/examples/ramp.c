/* Moves joint 1 of an arm by 0.1 rad in half a second and prints the TCP error.
 *
 *   cargo build --release -p flexarm-fmu
 *   cc crates/faces/flexarm-fmu/examples/ramp.c -Icrates/faces/flexarm-fmu/include \
 *      -Ltarget/release -lflexarm_fmu -Wl,-rpath,target/release -lm -o ramp
 *   ./ramp robots/kr210
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "flexarm.h"

static void check(int status)
{
    if (status != 0) {
        fprintf(stderr, "error: %s\n", flexarm_error());
        exit(1);
    }
}

static uint32_t reference(const flexarm_plant *arm, const char *name)
{
    int found = flexarm_find(arm, name);
    check(found < 0 ? -1 : 0);
    return (uint32_t)found;
}

/* The target position of the first joint under motion. */
static uint32_t first_target(const flexarm_plant *arm)
{
    for (uint32_t k = 0; k < flexarm_count(arm); k++)
        if (strstr(flexarm_name(arm, k), ".target_position") != NULL)
            return k;
    fprintf(stderr, "error: no joint has a target position\n");
    exit(1);
}

int main(int count, char **arguments)
{
    const char *robot = count > 1 ? arguments[1] : "robots/kr210";
    const double pi = 3.141592653589793, period = 1e-3;
    flexarm_plant *arm = flexarm_open(robot, NULL, NULL, 0.0, NULL, 0);
    if (arm == NULL)
        check(-1);
    uint32_t target = first_target(arm);
    uint32_t error = reference(arm, "tcp_error.length");
    printf("%s: %zu variables, moving %s\n", robot, flexarm_count(arm), flexarm_name(arm, target));

    check(flexarm_start(arm, 0.0));
    for (int k = 1; k <= 1000; k++) {
        double s = fmin(k * period / 0.5, 1.0);
        double q = 0.1 * 0.5 * (1.0 - cos(pi * s));
        check(flexarm_set(arm, &target, &q, 1));
        check(flexarm_step(arm, period));
        if (k % 100 == 0) {
            double length;
            check(flexarm_get(arm, &error, &length, 1));
            printf("%5.2f s  %8.4f mm\n", flexarm_time(arm), 1e3 * length);
        }
    }
    flexarm_free(arm);
    return 0;
}
