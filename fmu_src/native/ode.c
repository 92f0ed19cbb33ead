/* numerics/ode.py, numerics/events.py and laws/integrated.py: a power law under a force on the club
   head, integrated by collocation at Chebyshev nodes.

   The equations are d' = w, moved' = gained, w' and gained' from the force, with the compression d, the
   closing speed w, and of the ball the change of its velocity and the displacement beside its uniform
   motion. On a panel the slopes are Chebyshev series, found by Picard iteration at the nodes (Clenshaw
   & Norton, Comput. J. 6, 88, 1963). Panels are added as far as the phase is evaluated; kept are their
   initial states, and the series of one of them. */

/* So many HALVINGS lead from any double to the next one: registers of 80 bits (x87) have more numbers in
   between. */
enum { ITERATIONS = 30, MOST_INTEGRATED = 600, PANEL_TIMES = ORDER + 2, HALVINGS = 1100 };
enum { D, MOVED, W, GAINED, QUANTITIES };

/* Nearer than these (m, m/s), far beyond any contact, no force overflows. */
#define FARTHEST 1e13
#define FASTEST 1e100

typedef struct {
    double begin, end, start[QUANTITIES];
} PanelStart;

/* A panel with its series: D and MOVED have two orders more than the slopes, W and GAINED one. */
typedef struct {
    PanelStart at;
    double series[QUANTITIES][ORDER + 2], slopes[2][ORDER], force_slope[ORDER - 1];
} SolvedPanel;

typedef struct {
    double duration; /* s, as far as it is known; infinite if the bodies come to rest */
    int is_complete; /* whether the end is known */
    Refusal failure;
    Parameters p;
    Inputs acting;
    double v_ball, x_ball;
    double last[QUANTITIES], width; /* where the next panel begins, and its width */
    double most[2];                 /* the largest compression and force so far */
    int peak_count[2];              /* of force and compression: those above all before */
    Peak peaks[2][MAXIMA];
    int count, solved; /* panels, and which of them `panel` is */
    SolvedPanel panel;
    PanelStart starts[MOST_INTEGRATED];
} Integrated;

static double integrated_force(const Integrated *o, double d, double w)
{
    return law_force(&o->p, o->acting.k, o->acting.b, d, w);
}

/* Slopes of the closing speed and the ball's velocity, m/s2. */
static void accelerations(const Integrated *o, double force, double *closing, double *ball)
{
    *ball = force / o->p.m_ball;
    *closing = (o->acting.club_force - force) / o->p.m_club - *ball;
}

/* The speed in which errors count on a panel from this state on, m/s. */
static double error_scale(const Integrated *o, const double start[], double width)
{
    double force = fabs(integrated_force(o, start[D], start[W]));
    /* Without cancellation: forces in balance have rounding errors. */
    double ball = force / o->p.m_ball, club = (fabs(o->acting.club_force) + force) / o->p.m_club;
    return larger(larger(fabs(start[W]), width * larger(ball, club)), LEAST);
}

/* PANELS */

/* The slopes at the nodes of a panel; returns whether they converge. */
static int solve_slopes(const Integrated *o, const PanelStart *at, double width, double allowed,
                        double slopes[2][ORDER])
{
    double nodes[QUANTITIES][ORDER], half = 0.5 * width;
    for (int i = 0; i < QUANTITIES; i++)
        for (int n = 0; n < ORDER; n++) nodes[i][n] = at->start[i];
    for (int iteration = 0; iteration < ITERATIONS; iteration++) {
        int has_converged = 1;
        /* Before the force, which may be 0 at the start alone. */
        for (int n = 0; n < ORDER; n++)
            nodes[D][n] = at->start[D] + half * dot(INTEGRALS[n], nodes[W]);
        for (int n = 0; n < ORDER; n++) {
            /* The iteration diverges, or has no numbers. */
            if (!islessequal(fabs(nodes[D][n]), FARTHEST)) return 0;
            if (!islessequal(fabs(nodes[W][n]), FASTEST)) return 0;
            double force = integrated_force(o, nodes[D][n], nodes[W][n]);
            accelerations(o, force, &slopes[0][n], &slopes[1][n]);
        }
        for (int i = W; i <= GAINED; i++) {
            for (int n = 0; n < ORDER; n++) {
                double value = at->start[i] + half * dot(INTEGRALS[n], slopes[i - W]);
                if (!(fabs(value - nodes[i][n]) <= allowed)) has_converged = 0;
                nodes[i][n] = value;
            }
        }
        if (has_converged) return 1;
    }
    return 0;
}

/* The series of a panel from its slopes at the nodes. */
static void set_series(SolvedPanel *p)
{
    double half = 0.5 * (p->at.end - p->at.begin);
    for (int i = 0; i < 2; i++) {
        integrate(p->slopes[i], ORDER, p->at.start[W + i], half, p->series[W + i]);
        integrate(p->series[W + i], ORDER + 1, p->at.start[i], half, p->series[i]);
    }
    differentiate(p->slopes[1], p->force_slope);
}

/* The panel from t on, at most so wide, and the width to try for the next one; returns whether there
   is one. */
static int next_panel(const Integrated *o, double t, double *width, SolvedPanel *p)
{
    double shortest = SHORTEST * (t + *width), w = *width, excess = 0.0, values[2][ORDER];
    p->at.begin = t;
    memcpy(p->at.start, o->last, sizeof o->last);
    while (1) {
        w = (t + w) - t;
        double allowed = SERIES_TOLERANCE * error_scale(o, o->last, w);
        if (!solve_slopes(o, &p->at, w, allowed, values)) {
            if (w <= shortest) return 0;
            w *= 0.5;
            continue;
        }
        excess = 0.0;
        for (int i = 0; i < 2; i++) {
            interpolate(values[i], p->slopes[i]);
            double left_out = (fabs(p->slopes[i][0]) + fabs(p->slopes[i][1])) * w / allowed;
            excess = larger(excess, left_out);
        }
        if (excess <= 1.0 || w <= shortest) break;
        /* At a kink the last coefficients fall slowly with the width, elsewhere fast. */
        w *= smaller(larger(pow(excess, -0.4), 0.1), 0.5);
    }
    p->at.end = t + w;
    set_series(p);
    *width = pow(larger(excess, 1e-16), -1.0 / ORDER) * w;
    return 1;
}

/* A panel that was found before. */
static void solve_again(Integrated *o, int number)
{
    SolvedPanel *p = &o->panel;
    double values[2][ORDER];
    if (o->solved == number) return;
    p->at = o->starts[number];
    double width = p->at.end - p->at.begin;
    double allowed = SERIES_TOLERANCE * error_scale(o, p->at.start, width);
    solve_slopes(o, &p->at, width, allowed, values);
    for (int i = 0; i < 2; i++) interpolate(values[i], p->slopes[i]);
    set_series(p);
    o->solved = number;
}

static double argument_of(const SolvedPanel *p, double t)
{
    return 2.0 * ((t - p->at.begin) / (p->at.end - p->at.begin)) - 1.0;
}

/* A quantity; exactly at the start, where the series have rounding errors. */
static double quantity_at(const SolvedPanel *p, int quantity, double t)
{
    if (t <= p->at.begin) return p->at.start[quantity];
    int order = quantity < W ? ORDER + 2 : ORDER + 1;
    return evaluate(p->series[quantity], order, argument_of(p, t));
}

/* Begin, nodes in order and end: quantities have few extrema in between. */
static double panel_time(const SolvedPanel *p, int n)
{
    if (n == 0) return p->at.begin;
    if (n == PANEL_TIMES - 1) return p->at.end;
    return p->at.begin + 0.5 * (p->at.end - p->at.begin) * (1.0 + NODES[ORDER - n]);
}

/* EVENTS */

/* Quantities of the Quantity type; the slope of the force, of which the sign alone is used; what is
   left of force or compression. */
enum { FORCE_SLOPE = CLOSING + 1, LEFT };

static double value_on(const Integrated *o, const SolvedPanel *p, int of, double t)
{
    if (of == FORCE_SLOPE) return evaluate(p->force_slope, ORDER - 1, argument_of(p, t));
    double w = of == COMPRESSION ? 0.0 : quantity_at(p, W, t);
    if (of == CLOSING) return w;
    /* A force that grows from 0 at touch isn't one that has fallen to 0. */
    if (of == LEFT && w >= 0.0) return 1.0;
    double d = quantity_at(p, D, t);
    if (of == COMPRESSION) return d;
    double force = integrated_force(o, d, w);
    return of == FORCE ? force : smaller(d, force);
}

/* The first double after `low` at which a value (times the sign) isn't above 0; it isn't at
   `high`. */
static double bisect(const Integrated *o, const SolvedPanel *p, int of, double sign,
                     double low, double high)
{
    for (int n = 0; n < HALVINGS; n++) {
        double middle = 0.5 * (low + high);
        if (!(low < middle && middle < high)) break;
        if (sign * value_on(o, p, of, middle) > 0.0) low = middle;
        else high = middle;
    }
    return high;
}

/* Whether a minimum between these times ends the contact, or leaves that to rounding errors. */
static int check_minimum(Integrated *o, const SolvedPanel *p, int place, double low, double high,
                         double *end)
{
    int value = place ? FORCE : COMPRESSION, slope = place ? FORCE_SLOPE : CLOSING;
    if (!(value_on(o, p, slope, low) < 0.0 && 0.0 < value_on(o, p, slope, high))) return 0;
    double when = bisect(o, p, slope, -1.0, low, high), least = value_on(o, p, value, when);
    /* In the rounding errors of a small force it is none. */
    if (!(least < value_on(o, p, value, high))) return 0;
    if (least <= 0.0) {
        *end = when;
        return 1;
    }
    if (least <= GRAZING_LEFT * o->most[place]) o->failure = refusal(UNDECIDED, when, 0.0);
    return 0;
}

/* When force or compression falls to 0 on a panel, s; infinite if neither does. */
static double end_on(Integrated *o, const SolvedPanel *p)
{
    for (int n = 1; n < PANEL_TIMES; n++) {
        double low = panel_time(p, n - 1), high = panel_time(p, n), end = high, closing, ball;
        int is_end = value_on(o, p, LEFT, high) <= 0.0;
        if (!is_end && value_on(o, p, CLOSING, low) < 0.0)
            for (int place = 0; place < 2 && !o->failure.reason; place++)
                is_end = check_minimum(o, p, place, low, high, &end) || is_end;
        if (o->failure.reason) return INFINITY;
        if (is_end) {
            end = bisect(o, p, LEFT, 1.0, low, end);
            double w = value_on(o, p, CLOSING, end);
            accelerations(o, value_on(o, p, FORCE, end), &closing, &ball);
            if (w * w < 2.0 * GRAZING_LEFT * closing * o->most[0])
                o->failure = refusal(UNDECIDED, end, 0.0);
            return end;
        }
        o->most[0] = larger(o->most[0], value_on(o, p, COMPRESSION, high));
        o->most[1] = larger(o->most[1], value_on(o, p, FORCE, high));
    }
    return INFINITY;
}

/* Keep the maxima of a quantity on a panel that are above all before. */
static void keep_peaks(Integrated *o, const SolvedPanel *p, Quantity quantity)
{
    int slope = quantity == FORCE ? FORCE_SLOPE : CLOSING;
    int *count = &o->peak_count[quantity];
    for (int n = 1; n < PANEL_TIMES; n++) {
        double low = smaller(panel_time(p, n - 1), o->duration);
        double high = smaller(panel_time(p, n), o->duration);
        if (!(value_on(o, p, slope, low) > 0.0 && 0.0 >= value_on(o, p, slope, high))) continue;
        double when = bisect(o, p, slope, 1.0, low, high);
        Peak peak = {value_on(o, p, quantity, when), when};
        if (*count && peak.value <= o->peaks[quantity][*count - 1].value) continue;
        if (*count < MAXIMA) o->peaks[quantity][(*count)++] = peak;
    }
}

/* THE PHASE */

/* Contact force of bodies that the club force accelerates together, N. */
static double force_at_rest(const Integrated *o)
{
    return o->acting.club_force * (o->p.m_ball / (o->p.m_club + o->p.m_ball));
}

static int comes_to_rest(const Integrated *o, const SolvedPanel *p)
{
    double d = o->last[D], w = o->last[W], rest = force_at_rest(o);
    double moved = (p->at.end - p->at.begin) * larger(fabs(w), fabs(p->at.start[W]));
    return fabs(integrated_force(o, d, w) - rest) <= REST * rest && moved <= REST * d;
}

/* Add a panel, if the end isn't known yet; returns whether the duration has grown. */
static int integrated_extend(Integrated *o)
{
    double t = o->duration;
    if (o->is_complete || o->failure.reason) return 0;
    if (o->count == MOST_INTEGRATED) {
        o->failure = refusal(TOO_MANY_PANELS, t, 0.0);
        return 0;
    }
    SolvedPanel p;
    if (!next_panel(o, t, &o->width, &p)) {
        o->failure = refusal(NO_NUMBERS, t, 0.0);
        return 0;
    }
    double end = end_on(o, &p);
    if (o->failure.reason) return 0;
    o->panel = p;
    o->solved = o->count;
    o->starts[o->count++] = p.at;
    for (int i = 0; i < QUANTITIES; i++) o->last[i] = quantity_at(&p, i, p.at.end);
    o->is_complete = end < INFINITY;
    o->duration = o->is_complete ? end : p.at.end;
    if (!o->is_complete && comes_to_rest(o, &p)) {
        o->is_complete = 1;
        o->duration = INFINITY;
    }
    keep_peaks(o, &p, FORCE);
    keep_peaks(o, &p, COMPRESSION);
    return 1;
}

/* The width of a panel on which the force changes the speeds by about as much as they are. */
static double first_width(const Integrated *o)
{
    double d = o->last[D], w = o->last[W], force = integrated_force(o, d, w), closing, ball;
    double width = FIRST_WIDTH;
    accelerations(o, force, &closing, &ball);
    while (width > LEAST) {
        double later = integrated_force(o, d + (w + 0.5 * closing * width) * width,
                                        w + closing * width);
        /* Nor do the bodies come apart on it. */
        int has_parted = closing < 0.0 && closing * width * width < smaller(-d, w * w / closing);
        if (isfinite(later) && !has_parted
            && fabs(later - force) * width <= o->p.m_ball * error_scale(o, o->last, width))
            break;
        width *= 0.5;
    }
    return width;
}

static void integrated_begin(Integrated *o, const Parameters *p, Inputs inputs, Motion start)
{
    memset(o, 0, offsetof(Integrated, starts));
    o->p = *p;
    o->acting = inputs;
    o->v_ball = start.v_ball;
    o->x_ball = start.x_club - start.compression;
    o->last[D] = o->most[0] = start.compression;
    o->last[W] = start.closing;
    o->most[1] = integrated_force(o, start.compression, start.closing);
    if (!isfinite(o->most[1])) {
        o->failure = (Refusal){NOT_FINITE, SETTABLE, {start.compression, start.closing, o->most[1]}, FINE};
        return;
    }
    o->width = first_width(o);
    integrated_extend(o);
}

/* EVALUATION */

static int is_at_rest(const Integrated *o, double t)
{
    return o->is_complete && o->duration == INFINITY && t > o->starts[o->count - 1].end;
}

/* The panel that holds a time, the last one afterwards. */
static int panel_of(Integrated *o, double t)
{
    while (t > o->duration && integrated_extend(o)) continue;
    int low = 0, high = o->count - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (t < o->starts[middle].end) high = middle;
        else low = middle + 1;
    }
    return low;
}

/* The quantities at a time; NaN where they can't be computed. */
static void integrated_at(Integrated *o, double t, double q[QUANTITIES])
{
    int number = panel_of(o, t);
    if (!o->count || (o->failure.reason && t > o->duration)) {
        for (int i = 0; i < QUANTITIES; i++) q[i] = NAN;
        return;
    }
    if (!is_at_rest(o, t)) {
        const PanelStart *at = &o->starts[number];
        /* Results so far begin where a contact does: its first panel isn't solved again for that. */
        if (t > at->begin) solve_again(o, number);
        for (int i = 0; i < QUANTITIES; i++)
            q[i] = t > at->begin ? quantity_at(&o->panel, i, t) : at->start[i];
        return;
    }
    double pull = force_at_rest(o) / o->p.m_ball, after = t - o->starts[o->count - 1].end;
    q[D] = o->last[D];
    q[MOVED] = o->last[MOVED] + (o->last[GAINED] + 0.5 * pull * after) * after;
    q[W] = 0.0;
    q[GAINED] = o->last[GAINED] + pull * after;
}

static double integrated_value(Integrated *o, Quantity quantity, double t)
{
    double q[QUANTITIES];
    integrated_at(o, t, q);
    if (quantity != FORCE) return quantity == COMPRESSION ? q[D] : q[W];
    return is_at_rest(o, t) ? force_at_rest(o) : integrated_force(o, q[D], q[W]);
}

static State integrated_state(Integrated *o, double t)
{
    double q[QUANTITIES];
    integrated_at(o, t, q);
    double v_ball = o->v_ball + q[GAINED], x_ball = o->x_ball + (o->v_ball * t + q[MOVED]);
    double force = is_at_rest(o, t) ? force_at_rest(o) : integrated_force(o, q[D], q[W]);
    return (State){force, x_ball + q[D], x_ball, v_ball + q[W], v_ball, q[D]};
}

/* Whether the time before `end` is so short that the difference of two impulses would lose digits. */
static int is_short_of_panel(Integrated *o, double end, double width)
{
    const PanelStart *at = &o->starts[panel_of(o, end)];
    return o->count && width < SHORT_OF_PANEL * (at->end - at->begin);
}

static double integrated_impulse(Integrated *o, double begin, double width)
{
    double first[QUANTITIES], last[QUANTITIES];
    integrated_at(o, begin + width, last);
    if (!o->count) return NAN;
    integrated_at(o, begin, first);
    /* m_ball v_ball' = F */
    return o->p.m_ball * (last[GAINED] - first[GAINED]);
}
