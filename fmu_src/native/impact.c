/* impact.py: one impact as a sequence of exact phases: approach, contact, flight. */

typedef enum { APPROACH, CONTACT, FLIGHT } PhaseKind;

/* The bodies before first touch. The compression of the motion, below 0, and its low part, below
   the resolution of that, add up to minus the distance. */
typedef struct {
    Instant begin;
    double duration; /* s; infinite if they never meet */
    Motion motion;
    double compression_low;
} Approach;

/* First touch: the position of the ball's near side, m, and the club speed, m/s. */
typedef struct {
    Instant instant;
    double x_ball, club_speed;
} Touch;

/* Results of the contact so far. */
typedef struct {
    double contact_time, max_force, time_of_max_force, max_compression, impulse;
} Results;

/* The bodies after the contact, under a force on the club head. */
typedef struct {
    Instant begin;
    Motion motion;
    double club_force;
    int recovers;  /* the compression falls; once it has vanished, or would grow, it stays 0 */
    Instant separation;
    Motion at_separation;
    double lasted; /* how long the last contact phase lasted, s */
} Flight;

/* An impact in one of its phases. From touch on positions of motions are those since touch: differences
   of positions after a long approach would lose digits. The approach is kept until a step has moved past first touch: up to
   then a change of the club speed changes that. */
typedef struct {
    PhaseKind phase;
    Approach approach;
    Touch touch;
    Instant begin;  /* of the last contact phase */
    Motion motion;  /* at its start */
    Inputs acting;  /* in it: b may follow from a coefficient of restitution */
    Results before; /* those of the contact phases before it */
    Flight flight;
    Contact contact;
} Impact;

static void impact_copy(Impact *to, const Impact *from)
{
    memcpy(to, from, offsetof(Impact, contact));
    if (from->phase != APPROACH) contact_copy(&to->contact, &from->contact);
}

/* APPROACH */

static void begin_approach(Impact *i, const Parameters *p, double club_speed, Instant begin,
                           double x_ball, Instant compression)
{
    double v_ball = p->ball_speed, closing = club_speed - v_ball, distance = compression.high;
    double gap = -(distance + compression.low);
    memset(i, 0, offsetof(Impact, contact));
    i->phase = APPROACH;
    i->approach.begin = begin;
    i->approach.compression_low = compression.low;
    i->approach.motion =
        (Motion){x_ball + distance, x_ball, club_speed, v_ball, distance, closing};
    i->approach.duration = closing > SLOWEST ? (gap > 0.0 ? gap : 0.0) / closing : INFINITY;
}

/* Time since an event, s; 0 before it, and up to the clock's last bit after it. */
static double elapsed(Instant event, Instant instant)
{
    double t = since(event, instant);
    return t > RESOLUTION * event.high ? t : 0.0;
}

/* Whether no step has moved past the touch yet, by more than the clock's last bit. */
static int is_undecided(const Impact *i, Instant instant)
{
    const Approach *a = &i->approach;
    if (since(a->begin, instant) <= a->duration) return 1;
    return !elapsed(added(a->begin, a->duration), instant);
}

/* Go on with another club speed (m/s) from an instant on, where the touch is undecided. */
static void change_speed(Impact *i, const Parameters *p, double club_speed, Instant instant)
{
    Approach a = i->approach;
    Motion m = a.motion;
    double t = since(a.begin, instant);
    if (t >= a.duration) {
        double x_ball = m.x_ball + m.v_ball * a.duration;
        begin_approach(i, p, club_speed, instant, x_ball, (Instant){0.0, 0.0});
        return;
    }
    /* Without loss: a speed that changes at 10^6 points still closes the right gap. */
    Instant moved = added((Instant){m.compression, a.compression_low}, m.closing * t);
    begin_approach(i, p, club_speed, instant, m.x_ball + m.v_ball * t, moved);
}

/* CONTACT */

static void begin_contact(Impact *i, const Parameters *p, Inputs acting, Instant begin, Motion motion)
{
    i->phase = CONTACT;
    i->begin = begin;
    i->motion = motion;
    i->acting = acting;
    contact_begin(&i->contact, p, acting, motion);
}

static Inputs acting_inputs(const Parameters *p, Inputs inputs, double approach_speed)
{
    inputs.b = law_damping(p, inputs.k, inputs.b, approach_speed);
    return inputs;
}

static void begin_touch(Impact *i, const Parameters *p, Inputs inputs)
{
    Motion m = i->approach.motion;
    double duration = i->approach.duration, x_ball = m.x_ball + m.v_ball * duration;
    Instant begin = added(i->approach.begin, duration);
    Motion start = {0.0, 0.0, m.v_club, m.v_ball, 0.0, m.closing};
    i->touch = (Touch){begin, x_ball, m.v_club};
    begin_contact(i, p, acting_inputs(p, inputs, m.closing), begin, start);
}

/* Change a state of the dense output, t s after the start, to what a host may see: exact at the
   start; and neither force nor compression is below 0, whatever the rounding. */
static void clamp_state(const Impact *i, const Parameters *p, State *s, double t)
{
    if (!t) {
        Motion m = i->motion;
        double force = law_force(p, i->acting.k, i->acting.b, m.compression, m.closing);
        *s = (State){force, m.x_club, m.x_club - m.compression, m.v_club, m.v_ball, m.compression};
    }
    if (s->force < 0.0) s->force = 0.0;
    if (s->compression < 0.0) {
        s->x_ball = s->x_club;
        s->compression = 0.0;
    }
}

/* The state t s after the start of the contact phase, with positions since touch. */
static State state_since_touch(Impact *i, const Parameters *p, double t)
{
    State s = contact_dense(&i->contact, contact_scale(&i->contact) * t);
    clamp_state(i, p, &s, t);
    return s;
}

/* The largest contact force until t, s since the start of the contact phase, and its time since touch. */
static Peak peak_force(Impact *i, double t)
{
    const Results *before = &i->before;
    double time = before->contact_time, most = before->max_force;
    Peak peak = contact_largest(&i->contact, FORCE, t);
    /* k or b changed just before the peak: if the force keeps rising, the later phase counts. */
    int is_rising = peak.when > 0.0 && before->time_of_max_force == time;
    if (peak.value > most || (is_rising && peak.value >= most * (1.0 - 1e-15)))
        return (Peak){larger(peak.value, most), time + peak.when};
    return (Peak){most, before->time_of_max_force};
}

static Results results_until(Impact *i, double t)
{
    const Results *b = &i->before;
    Peak peak = peak_force(i, t);
    double compression = contact_largest(&i->contact, COMPRESSION, t).value;
    double impulse = contact_impulse(&i->contact, 0.0, t);
    return (Results){b->contact_time + t, peak.value, peak.when, larger(b->max_compression, compression),
                     b->impulse + impulse};
}

/* FLIGHT */

static void begin_flight(Impact *i, Instant begin, double lasted, Motion motion, double club_force)
{
    i->phase = FLIGHT;
    i->flight = (Flight){begin, motion, club_force, 1, begin, motion, lasted};
}

static State flight_state(const Impact *i, const Parameters *p, Instant instant)
{
    const Flight *f = &i->flight;
    double t = since(f->begin, instant), distance = f->motion.compression;
    double closing = f->motion.closing;
    double x_ball = i->touch.x_ball + (f->motion.x_ball + f->motion.v_ball * t);
    double gained = f->club_force / p->m_club * t;
    int falls = f->recovers && distance > 0.0 && 0.0 >= closing + gained;
    distance += (closing + 0.5 * gained) * t;
    double left = falls && distance > 0.0 ? distance : 0.0;
    return (State){0.0, x_ball + distance, x_ball, f->motion.v_club + gained, f->motion.v_ball, left};
}

static void change_club_force(Impact *i, const Parameters *p, double club_force, Instant instant)
{
    State s = flight_state(i, p, instant);
    Flight *f = &i->flight;
    /* The difference of the velocities would cancel. */
    double gained = f->club_force / p->m_club * since(f->begin, instant);
    double distance = s.compression ? s.compression : s.x_club - s.x_ball, x = i->touch.x_ball;
    f->motion = (Motion){s.x_club - x, s.x_ball - x, s.v_club, s.v_ball, distance,
                         f->motion.closing + gained};
    f->begin = instant;
    f->club_force = club_force;
    f->recovers = s.compression > 0.0;
}

/* THE IMPACT */

static int has_touched(const Impact *i) { return i->phase != APPROACH; }

/* How long the phase lasts, s, as far as that is known. */
static double phase_duration(const Impact *i)
{
    if (i->phase == APPROACH) return i->approach.duration;
    return i->phase == CONTACT ? i->contact.duration : INFINITY;
}

static Instant phase_begin(const Impact *i)
{
    if (i->phase == APPROACH) return i->approach.begin;
    return i->phase == CONTACT ? i->begin : i->flight.begin;
}

/* Go on to the next phase, with these inputs, or to the next piece of a contact; not from flight.
   Returns whether that can be computed. */
static int begin_next_phase(Impact *i, const Parameters *p, Inputs inputs)
{
    if (i->phase == APPROACH) {
        begin_touch(i, p, inputs);
        if (!contact_failure(&i->contact).reason) return 1;
        i->phase = APPROACH;
        return 0;
    }
    if (contact_extend(&i->contact)) return 1;
    if (contact_failure(&i->contact).reason) return 0;
    double duration = i->contact.duration;
    Motion end = contact_end(&i->contact);
    begin_flight(i, added(i->begin, duration), duration, end, inputs.club_force);
    return 1;
}

/* Go on to the phase that holds an instant, under these inputs; returns whether that can be
   computed. */
static int advance(Impact *i, const Parameters *p, Inputs inputs, Instant instant)
{
    while (since(phase_begin(i), instant) >= phase_duration(i))
        if (!begin_next_phase(i, p, inputs)) return 0;
    return 1;
}

/* Positions, velocities and compression at an instant of an approach or of flight. */
static State impact_state(const Impact *i, const Parameters *p, Instant instant)
{
    if (i->phase == FLIGHT) return flight_state(i, p, instant);
    const Approach *a = &i->approach;
    double t = since(a->begin, instant), closing = a->motion.closing;
    double x_ball = a->motion.x_ball + a->motion.v_ball * t;
    double compression = a->motion.compression + (a->compression_low + closing * t);
    /* Bodies that close aren't compressed yet, whatever the rounding. */
    double left = compression > 0.0 && 0.0 >= closing ? compression : 0.0;
    double x_club = x_ball + compression;
    return (State){0.0, x_club, x_ball, a->motion.v_club, a->motion.v_ball, left};
}

/* Go on with other inputs from an instant of the contact on; or return why that can't be computed. */
static Refusal change_contact(Impact *i, const Parameters *p, Inputs inputs, Instant instant)
{
    double approach_speed = i->touch.club_speed - p->ball_speed;
    Inputs acting = acting_inputs(p, inputs, approach_speed);
    if (acting.k == i->acting.k && acting.b == i->acting.b
        && acting.club_force == i->acting.club_force)
        return ACCEPTED;
    if (acting.club_force) {
        Refusal why = refusal_of_push(p, acting, approach_speed);
        if (why.reason) return why;
    }
    double t = elapsed(i->begin, instant);
    State s = state_since_touch(i, p, t);
    double d = s.compression;
    double closing = t ? contact_value(&i->contact, CLOSING, t) : i->motion.closing;
    Motion motion = {s.x_club, s.x_ball, s.v_club, s.v_ball, d, closing};
    double force = law_force(p, acting.k, acting.b, d, closing);
    if (!(force <= 0.0) || (!d && closing > 0.0)) {
        i->before = results_until(i, t);
        begin_contact(i, p, acting, instant, motion);
        return contact_failure(&i->contact);
    }
    begin_flight(i, instant, t, motion, inputs.club_force);
    return ACCEPTED;
}

/* Go on with other inputs from an instant on; a touch at this very instant hasn't been passed yet.
   Returns why that can't be computed. */
static Refusal change_inputs(Impact *i, const Parameters *p, Inputs before, Inputs inputs, Instant instant)
{
    if (is_undecided(i, instant)) {
        /* The contact that has been found for a read had other inputs. */
        i->phase = APPROACH;
        if (inputs.club_speed != before.club_speed) change_speed(i, p, inputs.club_speed, instant);
        return ACCEPTED;
    }
    if (!advance(i, p, before, instant)) return contact_failure(&i->contact);
    if (i->phase == CONTACT) return change_contact(i, p, inputs, instant);
    if (inputs.club_force != i->flight.club_force) change_club_force(i, p, inputs.club_force, instant);
    return ACCEPTED;
}

/* How long the last contact phase has lasted, s. */
static double contact_lasted(const Impact *i, Instant instant)
{
    return i->phase == FLIGHT ? i->flight.lasted : elapsed(i->begin, instant);
}

/* Mean contact force, N, over the last `step` seconds, however short they are. */
static double mean_force(Impact *i, Instant instant, double step)
{
    if (i->phase == APPROACH || !step) return 0.0;
    double end = contact_lasted(i, instant);
    /* From the start of the phase: the difference of two late times would lose all digits. */
    Instant from = i->phase == CONTACT ? i->begin : i->flight.separation;
    double begin = since(from, added(instant, -step));
    int is_whole = i->phase == CONTACT && begin > 0.0;
    begin = larger(0.0, i->phase == CONTACT ? begin : begin + end);
    if (!(begin < end)) return 0.0;
    return contact_impulse(&i->contact, begin, is_whole ? step : end - begin) / step;
}
