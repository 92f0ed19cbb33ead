/* component/outputs.py: the outputs, each a function of the impact at one instant.

   Results are "so far" at every instant. Before touch S and COR are 0 and the energy efficiency is 1.
   S is 0, too, if the club stood at touch. */

static double twice_kinetic_energy(const Parameters *p, double v_club, double v_ball)
{
    return p->m_club * v_club * v_club + p->m_ball * v_ball * v_ball;
}

/* A result of a contact; v_club and v_ball, m/s, are those at its end, or now. */
static double result(Component *c, Impact *i, uint32_t reference, double v_club, double v_ball)
{
    const Parameters *p = &c->is.parameters;
    double u = i->touch.club_speed, value;
    switch (reference) {
    case VR_touch_time: return c->is.origin + (i->touch.instant.high + i->touch.instant.low);
    case VR_smash_factor:
        value = u ? v_ball / u : 0.0;
        /* The club hardly moved: S leaves the range of a double, as if the club stood. */
        return isinf(value) ? 0.0 : value;
    case VR_coefficient_of_restitution: return (v_ball - v_club) / (u - p->ball_speed);
    case VR_energy_efficiency:
        value = twice_kinetic_energy(p, u, p->ball_speed);
        return value ? twice_kinetic_energy(p, v_club, v_ball) / value : 1.0;
    }
    const State *s = state_now(c);
    /* A contact that can't be computed has none, and NaN isn't compared. */
    if (isnan(s->force)) return NAN;
    double lasted = contact_lasted(i, instant_now(c));
    switch (reference) {
    case VR_contact_time: return i->before.contact_time + lasted;
    case VR_max_force: return larger(peak_force(i, lasted).value, s->force);
    case VR_time_of_max_force: return peak_force(i, lasted).when;
    case VR_max_compression:
        value = contact_largest(&i->contact, COMPRESSION, lasted).value;
        /* After law 2's separation the ball is still compressed, without force. */
        return larger(larger(i->before.max_compression, value), s->compression);
    case VR_contact_displacement:
        if (i->phase == FLIGHT) return i->flight.at_separation.x_ball;
        return c->is.is_solved ? s->x_ball - i->touch.x_ball : state_since_touch(i, p, lasted).x_ball;
    case VR_impulse:
        if (c->is.is_solved) return impulse_of_solution(c);
        return i->before.impulse + contact_impulse(&i->contact, 0.0, lasted);
    default: return NAN;
    }
}

/* The value of an output, by its value reference. */
static double output(Component *c, uint32_t reference)
{
    Impact *i = c->has_state ? &c->is.impact : present(c);
    const Parameters *p = &c->is.parameters;
    if (c->is.is_solved && NEEDS_HISTORY(reference)) return NAN;
    switch (reference) {
    case VR_force: return state_now(c)->force;
    case VR_club_position: return state_now(c)->x_club;
    case VR_ball_position: return state_now(c)->x_ball;
    case VR_club_velocity: return state_now(c)->v_club;
    case VR_ball_velocity: return state_now(c)->v_ball;
    case VR_compression: return state_now(c)->compression;
    case VR_momentum: return p->m_club * state_now(c)->v_club + p->m_ball * state_now(c)->v_ball;
    case VR_kinetic_energy:
        return 0.5 * twice_kinetic_energy(p, state_now(c)->v_club, state_now(c)->v_ball);
    case VR_mean_force: return mean_force(i, instant_now(c), c->is.last_step);
    case VR_touched: return has_touched(i);
    case VR_in_contact: return i->phase == CONTACT;
    case VR_separated: return i->phase == FLIGHT;
#if FMI_VERSION
    case VR_club_acceleration: return club_acceleration(c, i);
    case VR_ball_acceleration: return ball_acceleration(c, i);
    case VR_touch_indicator: return touch_indicator(c, i);
    case VR_separation_indicator: return separation_indicator(c, i);
#endif
#if FMI_VERSION == 3
    case VR_time: return c->is.origin + (instant_now(c).high + instant_now(c).low);
#endif
    }
    if (!has_touched(i))
        return reference == VR_touch_time ? c->is.start_time : reference == VR_energy_efficiency;
    const Motion *end = &i->flight.at_separation;
    if (i->phase == FLIGHT) return result(c, i, reference, end->v_club, end->v_ball);
    return result(c, i, reference, state_now(c)->v_club, state_now(c)->v_ball);
}

/* A value that the host takes for this type. Returns whether there is one. */
static int component_get(Component *c, uint32_t reference, Type type, double *value)
{
    int place = place_of(reference);
    *value = type == REAL ? NAN : 0.0;
    if (place < 0 || TABLE[place].type != type)
        return refuse_call(c, refusal(NOT_READABLE, reference, type));
    *value = place < SETTABLE ? c->is.values[place] : output(c, reference);
    return 1;
}

/* After a read of several values: why it can't be computed is reported, once for all of them. Returns
   whether it is so: then none of them is valid. */
static int has_read_failed(Component *c)
{
    Refusal why = take_failure(c);
    if (why.reason) report_one(c, why);
    return why.reason != FINE;
}
