/* component/state.py: the state of an instance, copied, and as bytes for another process.

   Bytes have a name that changes with the layout, every value, and a checksum; contacts are made again
   from their initial states. Bytes of other content are refused, or restored harmlessly. */

static const char LAYOUT[] = "golf-impact native state 3";

enum {
    STATE_SIZE = offsetof(Snapshot, impact.contact),
    PACKED_SIZE = sizeof LAYOUT + STATE_SIZE + sizeof(uint64_t)
};

static uint64_t checksum(const unsigned char bytes[], size_t size)
{
    uint64_t sum = UINT64_C(14695981039346656037); /* FNV-1a */
    for (size_t n = 0; n < size; n++) sum = (sum ^ bytes[n]) * UINT64_C(1099511628211);
    return sum;
}

/* Write a state as `PACKED_SIZE` bytes. */
static void packed(const Snapshot *from, unsigned char bytes[])
{
    memcpy(bytes, LAYOUT, sizeof LAYOUT);
    memcpy(bytes + sizeof LAYOUT, from, STATE_SIZE);
    uint64_t sum = checksum(bytes, sizeof LAYOUT + STATE_SIZE);
    memcpy(bytes + sizeof LAYOUT + STATE_SIZE, &sum, sizeof sum);
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
            || (int)r->type < 0 || r->type > UINT64 || r->prevented)
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
    uint64_t sum;
    memset(to, 0, sizeof *to);
    if (size != PACKED_SIZE || memcmp(bytes, LAYOUT, sizeof LAYOUT)) return 0;
    memcpy(&sum, bytes + size - sizeof sum, sizeof sum);
    if (sum != checksum(bytes, size - sizeof sum)) return 0;
    memcpy(to, bytes + sizeof LAYOUT, STATE_SIZE);
    to->impact.has_failed = 0;
    if (!is_possible(to)) return 0;
    if (to->has_impact && !to->is_solved && to->impact.phase != APPROACH)
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
