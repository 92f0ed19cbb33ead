/* The physics as WebAssembly. For the web page: one instance of the component, that is started,
   stepped and read by value references, as an importer does. Numbers pass as doubles; a sentence that
   says why something is refused is at `text`. For Python's functions: rows.c. Nothing is imported: no
   input, no output. */

#include "physics.c"

/* wasi-libc's would import a source of random numbers. */
uintptr_t __stack_chk_guard = 1;
void __stack_chk_fail(void);
void __stack_chk_fail(void) { __builtin_trap(); }

#define EXPORT(name) __attribute__((export_name(#name)))

static Component component;
static char sentence[SENTENCE_SIZE];

/* The first refusal is the one that is shown. */
static void keep_report(void *context, const char *text)
{
    (void)context;
    if (!*sentence) strncpy(sentence, text, sizeof sentence - 1);
}

EXPORT(text) const char *page_text(void) { return sentence; }

/* Begin a run with the start values. */
EXPORT(reset) void page_reset(void)
{
    memset(sentence, 0, sizeof sentence);
    component.report = keep_report;
    component_reset(&component);
    component_set_up(&component, 0.0);
    component_enter_initialization(&component);
}

/* Set an input or parameter. Returns whether its value is accepted. */
EXPORT(set) int page_set(uint32_t reference, double value)
{
    int place = place_of(reference);
    Type type = place < 0 ? REAL : TABLE[place].type;
    if (type == ENUMERATION && value != floor(value)) {
        Refusal why = {OUT_OF_RANGE, place, REAL, {value}};
        report_one(&component, why);
    } else {
        component_set(&component, reference, value, type);
    }
    return !*sentence;
}

/* Fix the values. Returns whether they are accepted together. */
EXPORT(start) int page_start(void) { return component_exit_initialization(&component); }

/* The variable to be corrected where values that are allowed are refused together; else no one's. */
static int about(Reason reason)
{
    switch (reason) {
    case EXPONENT_WITH_LAW_1: return VR_exponent;
    case RESTITUTION_AT_REST_WITH_LAW_1: return VR_restitution_at_rest;
    case DAMPING_RATIO: return VR_b;
    case TOUCH: return VR_club_speed;
    case LARGE_PUSH:
    case LARGE_PUSH_OF_POWER_LAW: return VR_club_force;
    default: return -1;
    }
}

EXPORT(about) int page_about(void)
{
    Parameters parameters = parameters_of(component.is.values);
    return about(conflict(&parameters, inputs_of(component.is.values)).reason);
}

/* Make a communication step from a point on, both in s. Returns whether it is accepted. */
EXPORT(step) int page_step(double point, double size) { return component_step(&component, point, size); }

/* The value of a variable at this communication point; NaN if it can't be computed. */
EXPORT(get) double page_get(uint32_t reference)
{
    int place = place_of(reference);
    double value = NAN;
    if (place >= 0) component_get(&component, reference, TABLE[place].type, &value);
    return has_read_failed(&component) ? NAN : value;
}

#include "rows.c"
