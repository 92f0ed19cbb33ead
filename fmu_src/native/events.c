/* Of FMI 3.0's co-simulation: event mode and early return. */

/* How long the phase lasts, s, found if that isn't known yet; infinite if it can't be computed. */
static double find_phase_end(Impact *i)
{
    while (i->phase == CONTACT && contact_extend(&i->contact)) continue;
    if (i->phase == CONTACT && contact_failure(&i->contact).reason) return INFINITY;
    return phase_duration(i);
}

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
    e->inputs = inputs_of(c->is.values);
    e->instant = instant_now(c);
    e->point = point;
    /* With inputs that are refused, so is the next step. */
    e->has_more = !change(c, e->inputs, &e->impact).reason;
}

/* When the next one is, s; whether there is one. */
static int next_event(const Component *c, Events *e, double *when)
{
    if (!e->has_more || !advance(&e->impact, &c->is.parameters, e->inputs, e->instant))
        return e->has_more = 0;
    double passed = elapsed(phase_begin(&e->impact), e->instant);
    double left = nextafter(find_phase_end(&e->impact) - passed, INFINITY);
    if (!isfinite(left)) return e->has_more = 0;
    /* A step that ends there must not be shorter, whatever the host's rounding. */
    *when = e->point + left;
    while (*when - e->point < left) *when = nextafter(*when, INFINITY);
    e->instant = added(e->instant, *when - e->point);
    e->point = *when;
    return 1;
}

/* One communication step; if early return is allowed, only until touch or separation. Returns whether
   it was accepted; whether it ends with an event; where it ends, s. An event inside a step that
   continues is over when the step ends, and isn't reported. */
static int component_step_to_event(Component *c, double point, double size, int early, int *is_event,
                                   double *reached)
{
    int is_sum = are_times(point, size);
    double end = is_sum ? point + size : point, when;
    Refusal list[MOST_REFUSALS];
    Events events;
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
    return component_step(c, point, size);
}
