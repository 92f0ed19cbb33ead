/* Model Exchange: the host's solver finds the motion from the equations, the indicators of touch and
   separation, and the outputs, which are computed here at each instant.

   The continuous states are positions (m) and velocities (m/s), each of club and ball. Until first
   touch the club has the speed of the input, and its state follows at events. Between events the phase
   holds at every instant, so that a solver may try states on both sides of an event. */

/* Added to an indicator that may be exactly 0 before its event: solvers look for changes of sign. */
#define ABOVE_ZERO 1e-18

/* An event nearer than this (in units of the contact's time scale, and relative to the host's time) has
   happened: a solver's root is some 1e-15 s off, and restarted before it would find it again. */
#define EVENT_IS_NEAR 1e-11
#define EVENT_IS_NEAR_IN_TIME 1e-15

/* THE STATE */

static void begin_solution(Component *c)
{
    Snapshot *is = &c->is;
    const Parameters *p = &is->parameters;
    is->time = is->start_time;
    /* From here on the clock is the host's time. */
    is->origin = 0.0;
    is->states[0] = -p->gap;
    is->states[1] = 0.0;
    is->states[2] = is->inputs.club_speed;
    is->states[3] = p->ball_speed;
}

/* Evaluate the state at the host's time, under its states and inputs. */
static void evaluate_solution(Component *c)
{
    if (!c->is.has_impact) begin_run(c);
    Snapshot *is = &c->is;
    Impact *i = &is->impact;
    const Parameters *p = &is->parameters;
    Inputs inputs = inputs_of(is->values);
    double x_club = is->states[0], x_ball = is->states[1], v_ball = is->states[3];
    double v_club = i->phase == APPROACH ? inputs.club_speed : is->states[2];
    double force = 0.0, compression = x_club - x_ball, closing = v_club - v_ball;
    int is_apart = 0;
    if (i->phase == APPROACH)
        i->approach.motion = (Motion){x_club, x_ball, v_club, v_ball, compression, closing};
    if (i->phase == CONTACT) {
        i->acting = acting_inputs(p, inputs, i->touch.club_speed - p->ball_speed);
        force = law_force(p, i->acting.k, i->acting.b, compression, closing);
        if (law_drag(p, i->acting.b)) is->is_dragged = 1;
    }
    if (i->phase == FLIGHT) {
        const Motion *start = &i->flight.at_separation;
        double t = is->time - i->flight.separation.high;
        i->flight.club_force = inputs.club_force;
        /* Even if a force turned the club at once, the compression would have vanished by then. */
        is_apart = 2.0 * start->compression + start->closing * t <= 0.0;
    }
    /* For the solver, force and compression continue smoothly below 0 until the event. */
    c->solver = (State){force, x_club, x_ball, v_club, v_ball, compression};
    c->state = c->solver;
    c->state.force = larger(0.0, force);
    c->state.compression = is_apart ? 0.0 : larger(0.0, compression);
}

static const State *solver_state(Component *c)
{
    const State *s = state_now(c);
    return c->is.is_solved ? &c->solver : s;
}

/* VARIABLES: in co-simulation they are there, too */

/* The drag on a body at this velocity, N. */
static double drag_on(const Component *c, const Impact *i, double velocity)
{
    return law_drag(&c->is.parameters, i->acting.b) * velocity;
}

static double club_acceleration(Component *c, Impact *i)
{
    double m_club = c->is.parameters.m_club;
    if (i->phase == APPROACH) return 0.0;
    if (i->phase == FLIGHT) return i->flight.club_force / m_club;
    const State *s = solver_state(c);
    double force = -(s->force + drag_on(c, i, s->v_club));
    return (i->acting.club_force ? force + i->acting.club_force : force) / m_club;
}

static double ball_acceleration(Component *c, Impact *i)
{
    if (i->phase != CONTACT) return 0.0;
    const State *s = solver_state(c);
    return (s->force - drag_on(c, i, s->v_ball)) / c->is.parameters.m_ball;
}

/* Whether the force has ended. At touch it is 0, too; but there the bodies still close at their
   approach speed. */
static int is_over(const Component *c, const Impact *i, const State *s)
{
    double approach = i->touch.club_speed - c->is.parameters.ball_speed;
    return s->force <= 0.0 && s->v_club - s->v_ball < 0.5 * approach;
}

static double distance_to_touch(const State *s)
{
    return larger(s->x_ball - s->x_club, s->v_ball - s->v_club) + ABOVE_ZERO;
}

/* Positive until the gap is closed and the bodies are closing, then -1. */
static double touch_indicator(Component *c, const Impact *i)
{
    return has_touched(i) ? -1.0 : distance_to_touch(solver_state(c));
}

/* Positive while there is a force, then negative: a root, as a power law's zero is too flat. */
static double separation_indicator(Component *c, Impact *i)
{
    if (i->phase != CONTACT) return has_touched(i) ? -1.0 : 1.0;
    const State *s = solver_state(c);
    double root = pow(fabs(s->force), 1.0 / c->is.parameters.exponent) + ABOVE_ZERO;
    return is_over(c, i, s) ? -root : root;
}

/* What the ball has gained, N.s; NaN once a drag has taken some of it. */
static double impulse_of_solution(const Component *c)
{
    const Parameters *p = &c->is.parameters;
    return c->is.is_dragged ? NAN : p->m_ball * (c->is.states[3] - p->ball_speed);
}

/* THE HOST'S SOLVER */

static void get_states(Component *c, double states[])
{
    present(c);
    memcpy(states, c->is.states, sizeof c->is.states);
}

/* The derivatives of the states. Returns whether there are any: not while values are refused. */
static int get_derivatives(Component *c, double derivatives[])
{
    Impact *i = present(c);
    derivatives[0] = c->solver.v_club;
    derivatives[1] = c->solver.v_ball;
    derivatives[2] = club_acceleration(c, i);
    derivatives[3] = ball_acceleration(c, i);
    return !c->is.refused_count && c->is.mode != START_REFUSED;
}

static void get_indicators(Component *c, double indicators[])
{
    Impact *i = present(c);
    indicators[0] = touch_indicator(c, i);
    indicators[1] = separation_indicator(c, i);
}

/* What happens at this instant; or why it may not. */
static Refusal handle_event(Component *c)
{
    Snapshot *is = &c->is;
    Impact *i = present(c);
    const Parameters *p = &is->parameters;
    Inputs inputs = inputs_of(is->values);
    Refusal why = conflict(p, inputs);
    if (why.reason) return why;
    State now = c->solver, ahead = now;
    double closing = now.v_club - now.v_ball;
    double near = EVENT_IS_NEAR * sqrt(p->m_club * (p->m_ball / (p->m_club + p->m_ball)) / inputs.k);
    near = larger(near, EVENT_IS_NEAR_IN_TIME * fabs(is->time));
    ahead.x_club += near * now.v_club;
    ahead.x_ball += near * now.v_ball;
    c->has_state = 0;
    if (i->phase == APPROACH) {
        is->states[2] = inputs.club_speed;
        if (distance_to_touch(&ahead) > ABOVE_ZERO || closing <= SLOWEST) return ACCEPTED;
        /* A solver is exact beside any force. */
        Inputs free = inputs;
        free.club_force = 0.0;
        why = refusal_of_touch(p, free);
        if (why.reason) return why;
        i->phase = CONTACT;
        i->touch = (Touch){{is->time, 0.0}, now.x_ball, now.v_club};
        i->begin = i->touch.instant;
    } else if (i->phase == CONTACT) {
        ahead.force = law_force(p, i->acting.k, i->acting.b, ahead.x_club - ahead.x_ball, closing);
        if (!is_over(c, i, &ahead)) return ACCEPTED;
        double lasted = is->time - i->touch.instant.high;
        /* From touch on an impact counts positions from the touch. */
        double x = i->touch.x_ball;
        Motion motion = {now.x_club - x, now.x_ball - x, now.v_club, now.v_ball, now.compression, closing};
        begin_flight(i, (Instant){is->time, 0.0}, lasted, motion, inputs.club_force);
    }
    return ACCEPTED;
}

/* Handle the events of this instant. Returns whether the call was legal; whether the host must stop,
   since values were refused. */
static int update_solution(Component *c, int *must_stop)
{
    Refusal list[MOST_REFUSALS];
    int count = take_refusals(c, list);
    *must_stop = 0;
    if (!count && c->is.mode != STEPPING) return refuse_call(c, refusal(NO_EVENT, 0.0, 0.0));
    if (!count) {
        list[0] = handle_event(c);
        count = list[0].reason != FINE;
    }
    if (count) report(c, list, count, MUST_STOP);
    *must_stop = count > 0;
    return 1;
}
