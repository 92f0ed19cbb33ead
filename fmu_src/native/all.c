/* The whole FMU in one file, for one call of a compiler: all but FMI's functions is static, so that
   nothing clashes where it is linked statically (TwinCAT, Simulink). FMI2_FUNCTION_PREFIX and
   FMI3_FUNCTION_PREFIX are honoured. */

#include "physics.c"
#include "directional_derivatives.c"
#include "state.c"

#if FMI_VERSION == 3
#include "events.c"
#if defined __GNUC__
#pragma GCC diagnostic ignored "-Wstrict-prototypes" /* of FMI's header */
#endif
#include "fmi3Functions.h"
#include "instance.c"
#include "fmi.c"
#include "fmi3.c"
#else
#include "fmi2Functions.h"
#ifdef FMI2_FUNCTION_PREFIX
/* Some copies of that header give every function its plain name. */
#undef fmi2FullName
#define PREFIXED(prefix, name) prefix##name
#define PREFIX_OF(prefix, name) PREFIXED(prefix, name)
#define fmi2FullName(name) PREFIX_OF(FMI2_FUNCTION_PREFIX, name)
#endif
#include "instance.c"
#include "fmi.c"
#include "fmi2.c"
#endif
