/* laws/contact.py: contact phases of all kinds.

   A phase is contact under constant k and b, from its initial state until the contact force is zero.
   Times are s since its start, at most `duration`. It is a value: what its functions return is
   independent of the order of calls. */

typedef enum { UNDERDAMPED, LINEAR, POWER_LAW, INTEGRATED } ContactKind;

typedef struct {
    ContactKind kind;
    double duration; /* s; infinite if contact never ends */
    /* By quantity, force and compression: whether the maxima have been found, how many, the first. */
    int found[2], count[2];
    Peak first[2];
    union {
        Underdamped underdamped;
        PowerLaw power_law;
        Integrated integrated;
        struct {
            LinearContact contact;
            Peak maxima[2][MAXIMA];
        } linear;
    } as;
} Contact;

/* A copy takes what the kind of contact has. */
static void contact_copy(Contact *to, const Contact *from)
{
    size_t size = sizeof *to;
    if (from->kind == UNDERDAMPED) size = offsetof(Contact, as) + sizeof(Underdamped);
    if (from->kind == LINEAR) size = offsetof(Contact, as) + sizeof(from->as.linear);
    if (from->kind == POWER_LAW) size = offsetof(Contact, as) + sizeof(PowerLaw);
    if (from->kind == INTEGRATED)
        size = offsetof(Contact, as.integrated.starts)
               + (size_t)from->as.integrated.count * sizeof(PanelStart);
    memcpy(to, from, size);
}

/* The phase that begins at `start`: first touch while closing, or a force above 0. The inputs are
   those that act. */
static void contact_begin(Contact *c, const Parameters *p, Inputs inputs, Motion start)
{
    memset(c, 0, offsetof(Contact, as));
    if (p->exponent != 1.0) {
        /* Under a force it has no closed form: in the scaled time that is a power of x. */
        c->kind = inputs.club_force ? INTEGRATED : POWER_LAW;
        if (c->kind == INTEGRATED) integrated_begin(&c->as.integrated, p, inputs, start);
        else power_law_begin(&c->as.power_law, p, inputs.k, inputs.b, start);
        c->duration = c->kind == INTEGRATED ? c->as.integrated.duration : c->as.power_law.duration;
        return;
    }
    Linear given = {inputs.k, law_damper(p, inputs.b), law_drag(p, inputs.b), p->m_club, p->m_ball,
                    inputs.club_force, start};
    Underdamped *underdamped = &c->as.underdamped;
    underdamped_begin(underdamped, given);
    c->kind = UNDERDAMPED;
    c->duration = underdamped->duration;
    if (c->duration) return;
    LinearContact *linear = &c->as.linear.contact;
    linear_begin(linear, given);
    c->kind = LINEAR;
    c->duration = linear->duration;
}

/* The time scale of the dense output, 1/s. */
static double contact_scale(Contact *c)
{
    return c->kind == UNDERDAMPED ? c->as.underdamped.rates.s : 1.0;
}

/* What the function of this name returns for the kind of contact. */
#define OF_KIND(c, function, ...)                                                                   \
    ((c)->kind == UNDERDAMPED  ? underdamped_##function(&(c)->as.underdamped, __VA_ARGS__)          \
     : (c)->kind == POWER_LAW  ? power_law_##function(&(c)->as.power_law, __VA_ARGS__)              \
     : (c)->kind == INTEGRATED ? integrated_##function(&(c)->as.integrated, __VA_ARGS__)            \
                               : linear_##function(&(c)->as.linear.contact, __VA_ARGS__))

/* The state at a scaled time. */
static State contact_dense(Contact *c, double time) { return OF_KIND(c, state, time); }

/* Force, compression, or the closing speed, to full relative accuracy. */
static double contact_value(Contact *c, Quantity quantity, double t)
{
    return OF_KIND(c, value, quantity, t);
}

/* Whether the closed form of the impulse of the time before `end` would lose digits. */
static int is_short(Contact *c, double end, double width)
{
    switch (c->kind) {
    case UNDERDAMPED: return width * c->as.underdamped.rate <= SHORT;
    case LINEAR: return width * c->as.linear.contact.rate <= SHORT;
    case INTEGRATED: return is_short_of_panel(&c->as.integrated, end, width);
    default: return 0; /* a power law's doesn't */
    }
}

/* Impulse of the contact force over [begin, begin + width], N.s. */
static double contact_impulse(Contact *c, double begin, double width)
{
    double end = begin + width, half = 0.5 * width, total = 0.0;
    if (!is_short(c, end, width)) return OF_KIND(c, impulse, begin, width);
    for (int n = 0; n < GAUSS_POINTS; n++)
        total += GAUSS_WEIGHTS[n] * contact_value(c, FORCE, end - half * (1.0 - GAUSS_NODES[n]));
    return half * total;
}

/* Why the contact can't be computed any further; the reason is FINE if it can. */
static Refusal contact_failure(const Contact *c)
{
    if (c->kind == INTEGRATED) return c->as.integrated.failure;
    return c->kind == LINEAR ? c->as.linear.contact.failure : ACCEPTED;
}

/* Evaluate another piece, if the end isn't known yet; whether the duration has grown. */
static int contact_extend(Contact *c)
{
    if (c->kind != INTEGRATED) return 0;
    int has_grown = integrated_extend(&c->as.integrated);
    c->duration = c->as.integrated.duration;
    return has_grown;
}

/* The bodies when contact ends. */
static Motion contact_end(Contact *c)
{
    State s = contact_dense(c, contact_scale(c) * c->duration);
    if (c->kind == UNDERDAMPED) underdamped_end_velocities(&c->as.underdamped, &s.v_club, &s.v_ball);
    double d = larger(0.0, s.compression);
    double closing = contact_value(c, CLOSING, c->duration);
    return (Motion){s.x_ball + d, s.x_ball, s.v_club, s.v_ball, d, closing};
}

/* MAXIMA */

static Peak *maximum(Contact *c, Quantity quantity, int n)
{
    if (c->kind == INTEGRATED) return &c->as.integrated.peaks[quantity][n];
    return n ? &c->as.linear.maxima[quantity][n] : &c->first[quantity];
}

static void find_maxima(Contact *c, Quantity quantity)
{
    double when[MAXIMA];
    int count;
    if (c->kind == INTEGRATED) return;
    switch (c->kind) {
    case UNDERDAMPED: count = underdamped_maxima(&c->as.underdamped, quantity, when); break;
    case POWER_LAW: count = power_law_maxima(&c->as.power_law, quantity, when); break;
    default: count = linear_maxima(&c->as.linear.contact, quantity, when);
    }
    for (int n = 0; n < count; n++)
        *maximum(c, quantity, n) = (Peak){contact_value(c, quantity, when[n]), when[n]};
    c->found[quantity] = 1;
    c->count[quantity] = count;
}

/* Whether no maximum lies between the start of an underdamped contact and t, shortly after it: then the
   largest value, too. */
static int is_largest_at_an_end(const Underdamped *o, Quantity quantity, double t, Peak *largest)
{
    if (t * o->rate > SHORT) return 0;
    Row row = quantity == FORCE ? o->force : o->d, slope = underdamped_slope(o, row);
    Row basis = underdamped_basis(o, t);
    double start = row.a + row.c, now = sum_of(row, basis);
    int rises = slope.a + slope.c > 0.0;
    if (rises && sum_of(slope, basis) <= FLAT * o->rate * fabs(now)) return 0;
    *largest = rises && now > start + ROUNDING * fabs(start) ? (Peak){now, t} : (Peak){start, 0.0};
    return 1;
}

/* The largest value of force or compression on [0, t], and its time. */
static Peak contact_largest(Contact *c, Quantity quantity, double t)
{
    Peak largest;
    if (c->kind == UNDERDAMPED && is_largest_at_an_end(&c->as.underdamped, quantity, t, &largest))
        return largest;
    /* Before the maxima: a phase in pieces is then evaluated up to t. */
    double now = contact_value(c, quantity, t);
    if (!c->found[quantity]) find_maxima(c, quantity);
    largest = (Peak){contact_value(c, quantity, 0.0), 0.0};
    const Peak *top = NULL;
    int count = c->kind == INTEGRATED ? c->as.integrated.peak_count[quantity] : c->count[quantity];
    for (int n = 0; n < count; n++) {
        const Peak *passed = maximum(c, quantity, n);
        if (passed->when <= t && (!top || passed->value > top->value)) top = passed;
    }
    /* A maximum just after the start is as large as the start to the last digits. */
    if (top && top->value >= largest.value - ROUNDING * fabs(largest.value)) largest = *top;
    /* Just after a maximum, rounding must not move its time. */
    if (now > largest.value + ROUNDING * fabs(largest.value)) largest = (Peak){now, t};
    return largest;
}
