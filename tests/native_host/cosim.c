/* Runs a system in libcosim's library, from a program that isn't Python.

   usage: cosim LIBCOSIMC FOLDER STEPS
     FOLDER    the extracted .ssp

   Prints the last outputs of ClubBallImpact, the component with the most variables. */

#include "fmu.h"

#include <stdbool.h>
#include <stdint.h>

int main(int argc, char **argv)
{
    if (argc != 4) fail("usage: cosim LIBCOSIMC FOLDER STEPS");
    void *library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (!library) fail(dlerror());
    void *(*create)(const char *, bool, int64_t) = symbol(library, "cosim_ssp_execution_create");
    void *(*new_observer)(void) = symbol(library, "cosim_last_value_observer_create");
    int (*add_observer)(void *, void *) = symbol(library, "cosim_execution_add_observer");
    int (*step)(void *, size_t) = symbol(library, "cosim_execution_step");
    int (*variables)(void *, int) = symbol(library, "cosim_slave_get_num_variables");
    int (*get)(void *, int, const uint32_t *, size_t, double *) =
        symbol(library, "cosim_observer_slave_get_real");
    int (*destroy)(void *) = symbol(library, "cosim_execution_destroy");
    const char *(*message)(void) = symbol(library, "cosim_last_error_message");

    void *execution = create(argv[2], false, 0), *observer = new_observer();
    if (!execution || add_observer(execution, observer)) fail(message());
    if (step(execution, (size_t)atol(argv[3]))) fail(message());
    int most = 0;
    for (int n = 1; n < 4; n++)
        if (variables(execution, n) > variables(execution, most)) most = n;
    const uint32_t references[] = {VR_smash_factor, VR_ball_velocity};
    double values[2];
    if (get(observer, most, references, 2, values)) fail(message());
    printf("smash_factor %.17g\nball_velocity %.17g\ndone\n", values[0], values[1]);
    destroy(execution);
    return 0;
}
