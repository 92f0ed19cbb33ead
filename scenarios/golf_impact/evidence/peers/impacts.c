/* Impacts as a host in C computes them: FMI 2.0's functions of an instance, by their addresses. */

#include "fmi2FunctionTypes.h"

/* `k` changes at each impact, and is the given one at the last. */
void impacts(int count, fmi2Component instance, fmi2FMUstate start, double k,
             const fmi2ValueReference *stiffness, const fmi2ValueReference *outputs,
             double *values, fmi2SetFMUstateTYPE *restore, fmi2SetRealTYPE *set,
             fmi2DoStepTYPE *step, fmi2GetRealTYPE *get)
{
    while (count--) {
        double changed = k * (1.0 + 1e-4 * count);
        if (start) restore(instance, start);
        set(instance, stiffness, 1, &changed);
        step(instance, 0.0, 1e-3, fmi2True);
        get(instance, outputs, 3, values);
    }
}
