/* The physics as WebAssembly, for Python's functions (golf_impact/engine.py) and the page: rows of
   impacts, each in one communication step, and one impact at many instants. Values and results lie in
   `space`, in columns; a sentence that says why something is refused is at `text`. Nothing is imported:
   no input, no output. */

#include "physics.c"

/* wasi-libc's would import a source of random numbers. */
uintptr_t __stack_chk_guard = 1;
void __stack_chk_fail(void);
void __stack_chk_fail(void) { __builtin_trap(); }

#define EXPORT(name) __attribute__((export_name(#name)))

/* The most rows, or instants, of one call. */
enum { ROWS = 4096 };

static struct {
    /* Inputs and parameters by row; below them instants, s. */
    double values[SETTABLE + 1][ROWS];
    double results[VARIABLES - SETTABLE][ROWS];
    uint32_t read[VARIABLES - SETTABLE]; /* the value references of the results */
    unsigned char ends[ROWS]; /* how each row has ended */
    int32_t count, outputs; /* how many rows or instants, and results of each */
} space;

/* The end of a row. */
enum { REFUSED, NOT_TOUCHED, TOUCHED, SEPARATED };

static Component solver;
static char sentence[SENTENCE_SIZE];

EXPORT(space) void *rows_space(void) { return &space; }

/* Names the sources that this module was compiled from. */
EXPORT(token) const char *rows_token(void) { return TOKEN; }

EXPORT(text) const char *rows_text(void) { return sentence; }

/* A communication step (s) within which the bodies touch and separate, if they ever do: horizon of
   golf_impact/runs.py. */
static double horizon(const Parameters *p, Inputs inputs)
{
    double closing = inputs.club_speed - p->ball_speed, n = p->exponent, d_r = p->reference_compression;
    double contact = PI * sqrt(p->m_club * (p->m_ball / (p->m_club + p->m_ball)) / inputs.k);
    if (n > 1.0 && fabs(closing) > SLOWEST) {
        double ratio = fabs(closing) * contact / (PI * d_r);
        contact = PI * d_r * pow(0.5 * (n + 1.0) * ratio * ratio, 1.0 / (n + 1.0)) / fabs(closing);
    }
    double step = larger(1.0, 20.0 * contact) + (closing > SLOWEST ? p->gap / closing : 0.0);
    return step < INFINITY ? step : 1.0;
}

/* Begin the impact of a row, up to an instant (s), or to a horizon if that is 0. Returns why it is
   refused. */
static Refusal begin_row(Component *c, int row, double *end)
{
    for (int n = 0; n < SETTABLE; n++) {
        double value = space.values[n][row];
        int is_whole = TABLE[n].type != ENUMERATION || value == floor(value);
        if (!(TABLE[n].low <= value && value <= TABLE[n].high && is_whole))
            return (Refusal){OUT_OF_RANGE, n, {value}, FINE};
        c->is.values[n] = value;
    }
    Refusal why = begin_run(c);
    if (why.reason) return why;
    c->is.mode = STEPPING;
    int is_ahead;
    if (!*end) *end = horizon(&c->is.parameters, c->is.inputs);
    return check_touch(c, &c->is.impact.approach, c->is.inputs, *end, &is_ahead);
}

/* Go to an instant (s) of the row's impact, not before the last one, by a step of `size` s. Returns
   why that can't be computed. */
static Refusal go_to(Component *c, double instant, double size)
{
    begin_steps(c, (Instant){instant, 0.0}, size);
    present(c);
    return take_failure(c);
}

static void read_results(Component *c, int row)
{
    for (int n = 0; n < space.outputs; n++) {
        uint32_t reference = space.read[n];
        component_get(c, reference, TABLE[place_of(reference)].type, &space.results[n][row]);
    }
}

/* An impact in one step. Returns why it is refused. */
static Refusal run_row(Component *c, int row)
{
    double step = 0.0;
    Refusal why = begin_row(c, row, &step);
    if (!why.reason) why = go_to(c, step, step);
    Impact *i = &c->is.impact;
    if (!why.reason && i->phase == FLIGHT && c->is.inputs.club_force) {
        /* To separation: the head would go on accelerating, for seconds after 0.6 ms. */
        step = (output(c, VR_touch_time) + output(c, VR_contact_time)) * (1.0 + 0x1p-51);
        why = go_to(c, step, step);
    }
    return why;
}

/* Compute the rows: NaN where one is refused. */
EXPORT(impacts) void rows_impacts(void)
{
    for (int row = 0; row < space.count; row++) {
        if (run_row(&solver, row).reason) {
            for (int n = 0; n < space.outputs; n++) space.results[n][row] = NAN;
            space.ends[row] = REFUSED;
            continue;
        }
        PhaseKind phase = solver.is.impact.phase;
        space.ends[row] = phase == APPROACH ? NOT_TOUCHED : phase == CONTACT ? TOUCHED : SEPARATED;
        read_results(&solver, row);
    }
}

/* What the following functions return: whether something is accepted; else why not is at `text`, and
   this is the place of the variable to be corrected, SETTABLE if it isn't a single one. */
enum { IS_ACCEPTED = -1 };

static int keep(Refusal why)
{
    Text text = {sentence, sentence + sizeof sentence - 1};
    *sentence = 0;
    if (!why.reason) return IS_ACCEPTED;
    put_refusal(&text, &why);
    return why.place;
}

/* Whether a row is accepted. */
EXPORT(explain) int rows_explain(int row) { return keep(run_row(&solver, row)); }

/* Begin the impact of the first row, up to an instant (s); whether it is accepted. */
EXPORT(begin) int rows_begin(double end) { return keep(begin_row(&solver, 0, &end)); }

/* Results of that impact at the instants, which rise, from one that has been reached (s); whether they
   can be computed. */
EXPORT(instants) int rows_instants(double reached)
{
    for (int row = 0; row < space.count; row++) {
        double instant = space.values[SETTABLE][row];
        Refusal why = go_to(&solver, instant, instant - reached);
        if (why.reason) return keep(why);
        read_results(&solver, row);
        reached = instant;
    }
    return IS_ACCEPTED;
}
