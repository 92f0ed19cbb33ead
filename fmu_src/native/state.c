/* component/state.py: the state of an instance, copied, and as bytes for another process.

   Bytes have a name that changes with the layout, every value, and a checksum; contacts are made again
   from their initial states. Bytes of other content are refused, or restored harmlessly. */

static const char LAYOUT[] = "golf-impact native state 1";

typedef struct {
    unsigned char *bytes; /* NULL: they are only counted */
    size_t count;
    int is_reading;
} Stream;

static void pass(Stream *s, void *value, size_t size)
{
    if (s->is_reading) memcpy(value, s->bytes + s->count, size);
    else if (s->bytes) memcpy(s->bytes + s->count, value, size);
    s->count += size;
}

static void pass_numbers(Stream *s, double values[], size_t count)
{
    pass(s, values, count * sizeof *values);
}

static void pass_integer(Stream *s, int *value)
{
    int32_t number = *value;
    pass(s, &number, sizeof number);
    *value = number;
}

#define PASS(s, numbers) pass_numbers(s, (double *)&(numbers), sizeof(numbers) / sizeof(double))

static void pass_refusals(Stream *s, Refusal refusals[], int most, int *count)
{
    pass_integer(s, count);
    for (int n = 0; n < most; n++) {
        int reason = (int)refusals[n].reason, type = (int)refusals[n].type;
        pass_integer(s, &reason);
        pass_integer(s, &refusals[n].place);
        pass_integer(s, &type);
        refusals[n].reason = (Reason)reason;
        refusals[n].type = (Type)type;
        PASS(s, refusals[n].numbers); /* of a call, so that nothing is prevented */
    }
}

static void pass_impact(Stream *s, Impact *i)
{
    int phase = (int)i->phase;
    pass_integer(s, &phase);
    i->phase = (PhaseKind)phase;
    PASS(s, i->approach.begin);
    PASS(s, i->approach.duration);
    PASS(s, i->approach.motion);
    PASS(s, i->approach.compression_low);
    PASS(s, i->touch.instant);
    PASS(s, i->touch.x_ball);
    PASS(s, i->touch.club_speed);
    PASS(s, i->begin);
    PASS(s, i->motion);
    PASS(s, i->acting);
    PASS(s, i->before);
    PASS(s, i->flight.begin);
    PASS(s, i->flight.motion);
    PASS(s, i->flight.club_force);
    pass_integer(s, &i->flight.is_pushed);
    pass_integer(s, &i->flight.recovers);
    PASS(s, i->flight.separation);
    PASS(s, i->flight.at_separation);
    PASS(s, i->flight.lasted);
}

static void pass_snapshot(Stream *s, Snapshot *is)
{
    int mode = (int)is->mode, first_phase = (int)is->first_phase;
    PASS(s, is->values);
    pass_integer(s, &mode);
    is->mode = (Mode)mode;
    pass_refusals(s, is->refused, SETTABLE + 1, &is->refused_count);
    pass_refusals(s, is->illegal, MOST_ILLEGAL, &is->illegal_count);
    PASS(s, is->start_time);
    PASS(s, is->origin);
    PASS(s, is->point);
    PASS(s, is->begin);
    PASS(s, is->last_step);
    PASS(s, is->count);
    PASS(s, is->inputs);
    pass_integer(s, &is->has_impact);
    pass_integer(s, &first_phase);
    is->first_phase = (PhaseKind)first_phase;
    PASS(s, is->parameters);
    pass_impact(s, &is->impact);
}

static uint64_t checksum(const unsigned char bytes[], size_t size)
{
    uint64_t sum = UINT64_C(14695981039346656037); /* FNV-1a */
    for (size_t n = 0; n < size; n++) sum = (sum ^ bytes[n]) * UINT64_C(1099511628211);
    return sum;
}

/* Write a state as bytes, unless they are NULL; returns how many. */
static size_t packed(const Snapshot *from, unsigned char *bytes)
{
    Stream s = {bytes, 0, 0};
    pass(&s, (char *)LAYOUT, sizeof LAYOUT);
    pass_snapshot(&s, (Snapshot *)from);
    if (bytes) {
        uint64_t sum = checksum(bytes, s.count);
        memcpy(bytes + s.count, &sum, sizeof sum);
    }
    return s.count + sizeof(uint64_t);
}

/* READING */

static int are_finite(const double values[], size_t count)
{
    for (size_t n = 0; n < count; n++)
        if (!isfinite(values[n])) return 0;
    return 1;
}

#define ARE_FINITE(numbers) are_finite((const double *)&(numbers), sizeof(numbers) / sizeof(double))

static int are_allowed(const double values[], size_t first, size_t count)
{
    for (size_t n = 0; n < count; n++) {
        const Variable *v = &TABLE[first + n];
        if (!isfinite(values[n]) || values[n] < v->low || values[n] > v->high) return 0;
        if (v->type == ENUMERATION && values[n] != floor(values[n])) return 0;
    }
    return 1;
}

static int are_refusals(const Refusal refusals[], int count, int most)
{
    if (count < 0 || count > most) return 0;
    for (int n = 0; n < count; n++) {
        const Refusal *r = &refusals[n];
        if ((int)r->reason <= FINE || r->reason > LAST_REASON || r->place < 0 || r->place > SETTABLE
            || (int)r->type < 0 || r->type > UINT64)
            return 0;
        if (r->place == SETTABLE && r->reason != START_TIME) return 0;
    }
    return 1;
}

static int is_case(const Parameters *p, Inputs inputs)
{
    return are_allowed((const double *)&inputs, 0, INPUTS)
           && are_allowed((const double *)p, INPUTS, SETTABLE - INPUTS) && !conflict(p, inputs).reason;
}

static int is_instant(Instant instant)
{
    return ARE_FINITE(instant) && fabs(instant.high) < LATEST && fabs(instant.low) < LATEST;
}

static int is_impact(const Impact *i, const Parameters *p)
{
    const Approach *a = &i->approach;
    const Flight *f = &i->flight;
    if (!is_instant(a->begin) || !ARE_FINITE(a->motion) || !ARE_FINITE(a->compression_low)
        || isnan(a->duration))
        return 0;
    if (i->phase == APPROACH) return 1;
    if (!is_instant(i->touch.instant) || !ARE_FINITE(i->touch.x_ball) || !is_instant(i->begin)
        || !ARE_FINITE(i->touch.club_speed) || !ARE_FINITE(i->motion) || i->motion.compression < 0.0
        || !ARE_FINITE(i->before) || !is_case(p, i->acting))
        return 0;
    if (i->phase == CONTACT) return 1;
    return i->phase == FLIGHT && is_instant(f->begin) && ARE_FINITE(f->motion)
           && ARE_FINITE(f->club_force) && is_instant(f->separation) && ARE_FINITE(f->at_separation)
           && ARE_FINITE(f->lasted);
}

/* Whether these could be the values of an instance. */
static int is_possible(const Snapshot *is)
{
    if (!are_allowed(is->values, 0, SETTABLE) || (int)is->mode < INSTANTIATED
        || is->mode > TERMINATED
        || !are_refusals(is->refused, is->refused_count, SETTABLE + 1)
        || !are_refusals(is->illegal, is->illegal_count, MOST_ILLEGAL) || !ARE_FINITE(is->start_time)
        || !ARE_FINITE(is->origin) || isnan(is->point) || !is_instant(is->begin)
        || !ARE_FINITE(is->last_step) || !ARE_FINITE(is->count) || is->last_step < 0.0
        || is->count < 0.0 || is->last_step * is->count >= LATEST)
        return 0;
    if (!is->has_impact) return is->mode != STEPPING;
    return is_case(&is->parameters, is->inputs) && is_impact(&is->impact, &is->parameters);
}

/* Read a state from bytes; returns whether they are one of this version's. */
static int unpacked(Snapshot *to, const unsigned char bytes[], size_t size)
{
    Stream s = {(unsigned char *)bytes, sizeof LAYOUT, 1};
    uint64_t sum;
    memset(to, 0, sizeof *to);
    if (size != packed(to, NULL) || memcmp(bytes, LAYOUT, sizeof LAYOUT)) return 0;
    memcpy(&sum, bytes + size - sizeof sum, sizeof sum);
    if (sum != checksum(bytes, size - sizeof sum)) return 0;
    pass_snapshot(&s, to);
    if (!is_possible(to)) return 0;
    if (to->has_impact && to->impact.phase != APPROACH)
        contact_begin(&to->impact.contact, &to->parameters, to->impact.acting, to->impact.motion);
    return 1;
}

/* COPIES */

static void snapshot_copy(Snapshot *to, const Snapshot *from)
{
    memcpy(to, from, offsetof(Snapshot, impact));
    impact_copy(&to->impact, &from->impact);
}

/* Go back to a state: the instance is then exactly as it was. */
static void component_restore(Component *c, const Snapshot *from)
{
    snapshot_copy(&c->is, from);
    c->check_every_step = c->has_state = 0;
    c->point_is_free = 1;
    c->size = NAN;
}
