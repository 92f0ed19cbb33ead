/* The physics and the component, without FMI: each file needs those above it. */

#include "golf.h"

#include "text.c"
#include "chebyshev.c"
#include "linear.c"
#include "power_law.c"
#include "law.c"
#include "ode.c"
#include "contact.c"
#include "impact.c"
#include "refusals.c"
#include "component.c"
#include "model_exchange.c"
#include "outputs.c"
