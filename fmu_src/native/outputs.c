/* component/outputs.py: the outputs, each a function of the impact at one instant.

   Results are "so far" at every instant. Before touch S and COR are 0 and the energy efficiency is 1.
   S is 0, too, if the club stood at touch. */

static int has_touched(const Impact *i) { return i->phase != APPROACH; }

/* The velocities of club and ball, m/s: in contact now, before touch, or at separation. */
static void velocities_of_results(Component *c, const Impact *i, double *v_club, double *v_ball)
{
    const Motion *m = i->phase == APPROACH ? &i->approach.motion : &i->flight.at_separation;
    *v_club = i->phase == CONTACT ? state_now(c)->v_club : m->v_club;
    *v_ball = i->phase == CONTACT ? state_now(c)->v_ball : m->v_ball;
}

/* Now: after separation a force may have changed them. */
static void velocities_now(Component *c, const Impact *i, double *v_club, double *v_ball)
{
    velocities_of_results(c, i, v_club, v_ball);
    if (i->phase != FLIGHT || !i->flight.is_pushed) return;
    *v_club = state_now(c)->v_club;
    *v_ball = state_now(c)->v_ball;
}

static double twice_kinetic_energy(const Parameters *p, double v_club, double v_ball)
{
    return p->m_club * v_club * v_club + p->m_ball * v_ball * v_ball;
}

static double output_mean_force(Component *c, Impact *i)
{
    return mean_force(i, instant_now(c), c->is.last_step);
}

static double output_touched(Component *c, Impact *i) { return (void)c, has_touched(i); }
static double output_in_contact(Component *c, Impact *i) { return (void)c, i->phase == CONTACT; }
static double output_separated(Component *c, Impact *i) { return (void)c, i->phase == FLIGHT; }

static double output_touch_time(Component *c, Impact *i)
{
    if (!has_touched(i)) return c->is.start_time;
    return c->is.origin + (i->touch.instant.high + i->touch.instant.low);
}

static double output_smash_factor(Component *c, Impact *i)
{
    double v_club, v_ball;
    if (!has_touched(i) || !i->touch.club_speed) return 0.0;
    velocities_of_results(c, i, &v_club, &v_ball);
    double factor = v_ball / i->touch.club_speed;
    /* The club hardly moved: S leaves the range of a double, as if the club stood. */
    return isinf(factor) ? 0.0 : factor;
}

static double output_coefficient_of_restitution(Component *c, Impact *i)
{
    double v_club, v_ball;
    if (!has_touched(i)) return 0.0;
    velocities_of_results(c, i, &v_club, &v_ball);
    return (v_ball - v_club) / (i->touch.club_speed - c->is.parameters.ball_speed);
}

static double output_energy_efficiency(Component *c, Impact *i)
{
    const Parameters *p = &c->is.parameters;
    double v_club, v_ball;
    if (!has_touched(i)) return 1.0;
    velocities_of_results(c, i, &v_club, &v_ball);
    double at_touch = twice_kinetic_energy(p, i->touch.club_speed, p->ball_speed);
    return at_touch ? twice_kinetic_energy(p, v_club, v_ball) / at_touch : 1.0;
}

static double output_contact_time(Component *c, Impact *i)
{
    return has_touched(i) ? i->before.contact_time + contact_lasted(i, instant_now(c)) : 0.0;
}

static Peak peak_force(Component *c, Impact *i)
{
    return later_peak(&i->before, contact_largest(&i->contact, FORCE, contact_lasted(i, instant_now(c))));
}

static double output_max_force(Component *c, Impact *i)
{
    return has_touched(i) ? larger(peak_force(c, i).value, state_now(c)->force) : 0.0;
}

static double output_time_of_max_force(Component *c, Impact *i)
{
    return has_touched(i) ? peak_force(c, i).when : 0.0;
}

static double output_max_compression(Component *c, Impact *i)
{
    if (!has_touched(i)) return 0.0;
    double lasted = contact_lasted(i, instant_now(c));
    double deepest = contact_largest(&i->contact, COMPRESSION, lasted).value;
    /* After law 2's separation the ball is still compressed, without force. */
    return larger(larger(i->before.max_compression, deepest), state_now(c)->compression);
}

static double output_contact_displacement(Component *c, Impact *i)
{
    if (!has_touched(i)) return 0.0;
    if (i->phase == FLIGHT) return i->flight.at_separation.x_ball;
    if (c->is.is_solved) return state_now(c)->x_ball - i->touch.x_ball;
    return state_since_touch(i, &c->is.parameters, elapsed(i, instant_now(c))).x_ball;
}

static double output_impulse(Component *c, Impact *i)
{
    if (!has_touched(i)) return 0.0;
    return i->before.impulse + contact_impulse(&i->contact, 0.0, contact_lasted(i, instant_now(c)));
}

static double output_momentum(Component *c, Impact *i)
{
    double v_club, v_ball;
    velocities_now(c, i, &v_club, &v_ball);
    return c->is.parameters.m_club * v_club + c->is.parameters.m_ball * v_ball;
}

static double output_kinetic_energy(Component *c, Impact *i)
{
    double v_club, v_ball;
    velocities_now(c, i, &v_club, &v_ball);
    return 0.5 * twice_kinetic_energy(&c->is.parameters, v_club, v_ball);
}

#include "model_exchange.c"
#if FMI_VERSION == 3
#include "events.c"
#endif

/* The value of an output beside the state of the bodies, by its value reference. */
static double output(Component *c, uint32_t reference)
{
    Impact *i = present(c);
    if (c->is.is_solved && needs_history(reference)) return NAN;
    if (c->is.is_solved && reference == VR_impulse && has_touched(i)) return impulse_of_solution(c);
    switch (reference) {
#define CASE(name) case VR_##name: return output_##name(c, i);
    OUTPUTS(CASE)
#undef CASE
    default: return NAN;
    }
}

/* A value that the host takes for this type. Returns whether there is one. */
static int component_get(Component *c, uint32_t reference, Type type, double *value)
{
    int place = place_of(reference);
    *value = type == REAL ? NAN : 0.0;
    if (place < 0 || TABLE[place].type != type) {
        refuse_call(c, (Refusal){NOT_READABLE, 0, type, {reference}, FINE});
        return 0;
    }
    switch (reference) {
    case VR_force: *value = state_now(c)->force; return 1;
    case VR_club_position: *value = state_now(c)->x_club; return 1;
    case VR_ball_position: *value = state_now(c)->x_ball; return 1;
    case VR_club_velocity: *value = state_now(c)->v_club; return 1;
    case VR_ball_velocity: *value = state_now(c)->v_ball; return 1;
    case VR_compression: *value = state_now(c)->compression; return 1;
    }
    *value = place < SETTABLE ? c->is.values[place] : output(c, reference);
    return 1;
}

/* After a read of several values: why it can't be computed is reported, once for all of them. Returns
   whether it is so: then none of them is valid. */
static int has_read_failed(Component *c)
{
    if (!c->has_failed) return 0;
    c->has_failed = c->has_state = 0;
    report_one(c, refusal_of_failure(contact_failure(&c->is.impact.contact), NOT_COMPUTABLE,
                                     0.0, 0.0));
    return 1;
}
