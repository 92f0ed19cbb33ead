/* Of FMI 3.0: event mode, early return, and the variables that FMI 2.0 doesn't have. */

/* Added to an indicator that may be exactly 0 before its event: solvers look for changes of sign. */
#define ABOVE_ZERO 1e-18

/* VARIABLES */

static double output_time(Component *c, Impact *i)
{
    Instant now = instant_now(c);
    (void)i;
    return c->is.origin + (now.high + now.low);
}

/* The drag on a body at this velocity, N. */
static double drag_on(const Component *c, const Impact *i, double velocity)
{
    return law_drag(&c->is.parameters, i->acting.b) * velocity;
}

static double output_club_acceleration(Component *c, Impact *i)
{
    double m_club = c->is.parameters.m_club;
    if (i->phase == APPROACH) return 0.0;
    if (i->phase == FLIGHT) return i->flight.club_force / m_club;
    const State *s = state_now(c);
    double force = -(s->force + drag_on(c, i, s->v_club));
    return (i->acting.club_force ? force + i->acting.club_force : force) / m_club;
}

static double output_ball_acceleration(Component *c, Impact *i)
{
    if (i->phase != CONTACT) return 0.0;
    const State *s = state_now(c);
    return (s->force - drag_on(c, i, s->v_ball)) / c->is.parameters.m_ball;
}

/* Positive until the gap is closed and the bodies are closing, then -1. */
static double output_touch_indicator(Component *c, Impact *i)
{
    if (has_touched(i)) return -1.0;
    const State *s = state_now(c);
    return larger(s->x_ball - s->x_club, s->v_ball - s->v_club) + ABOVE_ZERO;
}

/* Positive while there is a force, then negative: a root, as a power law's zero is too flat. */
static double output_separation_indicator(Component *c, Impact *i)
{
    if (i->phase != CONTACT) return has_touched(i) ? -1.0 : 1.0;
    const State *s = state_now(c);
    double root = pow(fabs(s->force), 1.0 / c->is.parameters.exponent);
    /* The force is 0 at touch, too; but then the bodies still close at their approach speed. */
    double approach = i->touch.club_speed - c->is.parameters.ball_speed;
    int is_over = s->force <= 0.0 && s->v_club - s->v_ball < 0.5 * approach;
    return is_over ? -root - ABOVE_ZERO : root + ABOVE_ZERO;
}

/* EVENTS */

/* Touch and separation that are still to come, one after the other, if the host's time is `point`. */
typedef struct {
    int has_more;
    Impact impact;
    Inputs inputs;
    Instant instant;
    double point;
} Events;

static void begin_events(Component *c, double point, Events *e)
{
    int is_another;
    e->inputs = inputs_of(c->is.values);
    e->instant = instant_now(c);
    e->point = point;
    /* With inputs that are refused, so is the next step. */
    e->has_more = !change(c, e->inputs, &e->impact, &is_another).reason;
}

/* When the next one is, s; whether there is one. */
static int next_event(const Component *c, Events *e, double *when)
{
    if (!e->has_more || !advance(&e->impact, &c->is.parameters, e->inputs, e->instant))
        return e->has_more = 0;
    double t = since(phase_begin(&e->impact), e->instant);
    double passed = t > RESOLUTION * phase_begin(&e->impact).high ? t : 0.0;
    double left = nextafter(find_phase_end(&e->impact) - passed, INFINITY);
    if (!isfinite(left)) return e->has_more = 0;
    /* A step that ends there must not be shorter, whatever the host's rounding. */
    *when = e->point + left;
    while (*when - e->point < left) *when = nextafter(*when, INFINITY);
    e->instant = added(e->instant, *when - e->point);
    e->point = *when;
    return 1;
}

/* The events of this instant are handled. Returns whether the call was legal; whether the host must
   stop, since values were refused; whether the next event is known, and the host's time of that. */
static int component_update(Component *c, int *must_stop, int *is_known, double *when)
{
    Refusal list[SETTABLE + 1 + MOST_ILLEGAL];
    Snapshot *is = &c->is;
    int count = is->mode == START_REFUSED ? start_run(c, list) : 0;
    *must_stop = *is_known = 0;
    if (!count && is->mode != STEPPING) {
        refuse_call(c, refusal(NO_EVENT, 0.0, 0.0));
        return 0;
    }
    if (count) {
        report(c, list, count, SENTENCES[MUST_STOP]);
        *must_stop = 1;
        return 1;
    }
    Events events;
    Host host = hold(c);
    begin_events(c, is->point, &events);
    *is_known = next_event(c, &events, when);
    release(&host);
    return 1;
}

/* One communication step; if early return is allowed, only until touch or separation. Returns whether
   it was accepted; whether it ends with an event; where it ends, s. An event inside a step that
   continues is over when the step ends, and isn't reported. */
static int component_step_to_event(Component *c, double point, double size, int early, int *is_event,
                                   double *reached)
{
    int is_sum = isfinite(point) && isfinite(size) && fabs(point) <= LONGEST && fabs(size) <= LONGEST;
    double end = is_sum ? point + size : point, when;
    Refusal list[SETTABLE + 1];
    Events events;
    Host host = hold(c);
    *is_event = 0;
    *reached = end;
    /* Start values may have been corrected since initialization ended. */
    if (c->is.mode == START_REFUSED) start_run(c, list);
    if (c->is.mode == STEPPING && is_sum) {
        begin_events(c, point, &events);
        while (next_event(c, &events, &when) && when <= end) {
            if (when != end && !(early && when > point)) continue;
            *is_event = 1;
            *reached = when;
            if (when != end) size = when - point;
            break;
        }
    }
    release(&host);
    return component_step(c, point, size);
}
