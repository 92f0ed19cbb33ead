/* The whole FMU in one file, for one call of a compiler: all but FMI's functions is static, so that
   nothing clashes where it is linked statically (TwinCAT, Simulink). FMI2_FUNCTION_PREFIX and
   FMI3_FUNCTION_PREFIX are honoured. */

#include "golf.h"

#include "big.c"
#include "chebyshev.c"
#include "extended.c"
#include "closed_form.c"
#include "power_law.c"
#include "law.c"
#include "ode.c"
#include "contact.c"
#include "impact.c"
#include "refusals.c"
#include "component.c"
#include "outputs.c"
#include "state.c"

#if FMI_VERSION == 3
#if defined __GNUC__
#pragma GCC diagnostic ignored "-Wstrict-prototypes" /* of FMI's header */
#endif
#include "fmi3Functions.h"
#include "instance.c"
#include "fmi3.c"
#else
#include "fmi2Functions.h"
#ifdef FMI2_FUNCTION_PREFIX /* which fmpy's copy of the header leaves out */
#undef fmi2FullName
#define PASTE(a, b) a##b
#define JOIN(a, b) PASTE(a, b)
#define fmi2FullName(name) JOIN(FMI2_FUNCTION_PREFIX, name)
#endif
#include "instance.c"
#include "fmi2.c"
#endif
