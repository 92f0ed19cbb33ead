/* Directional derivatives in Model Exchange: of inputs, states and time, the changes; of all else, the
   change that these lead to at one instant. */

typedef struct {
    double k, b, club_speed, club_force, x_club, x_ball, v_club, v_ball, time;
} Change;

/* The place of an input, a state or time in a change; NULL for other variables. */
static double *known_change(Change *d, uint32_t reference)
{
    switch (reference) {
    case VR_k: return &d->k;
    case VR_b: return &d->b;
    case VR_club_speed: return &d->club_speed;
    case VR_club_force: return &d->club_force;
    case VR_club_position: return &d->x_club;
    case VR_ball_position: return &d->x_ball;
    case VR_club_velocity: return &d->v_club;
    case VR_ball_velocity: return &d->v_ball;
#if FMI_VERSION == 3
    case VR_time: return &d->time;
#endif
    default: return NULL;
    }
}

/* Of b as it acts: with a coefficient of restitution it is a multiple of the root of k. */
static double damping_change(const Component *c, const Impact *i, const Change *d)
{
    return c->is.parameters.restitution_at_rest ? 0.5 * i->acting.b / i->acting.k * d->k : d->b;
}

/* d|x|^m / d|x|, without an exception where it is infinite. */
static double power_slope(double x, double m)
{
    return x || m >= 1.0 ? m * pow(fabs(x), m - 1.0) : INFINITY;
}

static double force_change(const Component *c, const Impact *i, const Change *d)
{
    if (i->phase != CONTACT) return 0.0;
    const Parameters *p = &c->is.parameters;
    const State *s = &c->solver;
    double m = 0.5 * (p->exponent - 1.0), d_r = p->reference_compression, k = i->acting.k;
    double x = s->compression, closing = s->v_club - s->v_ball, dx = d->x_club - d->x_ball;
    double damping = law_damper(p, i->acting.b) * closing;
    double d_damping = law_damper(p, damping_change(c, i, d)) * closing
                       + law_damper(p, i->acting.b) * (d->v_club - d->v_ball);
    double power = pow(fabs(x) / d_r, m);
    double change = power * (d->k * power * x + d_damping) + p->exponent * k * power * power * dx;
    if (m && damping * dx != 0.0) change += power_slope(x / d_r, m) / d_r * (x < 0.0 ? -dx : dx) * damping;
    return change;
}

static double drag_change(const Component *c, const Impact *i, const Change *d, double v, double dv)
{
    return i->phase == CONTACT ? law_drag(&c->is.parameters, d->b) * v + drag_on(c, i, dv) : 0.0;
}

static double indicator_change(const Component *c, const Impact *i, const Change *d)
{
    const State *s = &c->solver;
    double n = c->is.parameters.exponent, change = force_change(c, i, d);
    if (!change) return 0.0;
    if (n != 1.0) change *= power_slope(s->force, 1.0 / n);
    return (s->force < 0.0) != is_over(c, i, s) ? -change : change;
}

/* Of an output, a derivative or an indicator; NaN of outputs that are NaN. */
static double unknown_change(Component *c, uint32_t reference, const Change *d)
{
    const Impact *i = present(c);
    const Parameters *p = &c->is.parameters;
    const State *s = &c->solver;
    int is_contact = i->phase == CONTACT, is_free = i->phase == APPROACH;
    double v_club = is_free ? d->club_speed : d->v_club, u = i->touch.club_speed;
    double energy = p->m_club * s->v_club * v_club + p->m_ball * s->v_ball * d->v_ball;
    double at_touch = twice_kinetic_energy(p, u, p->ball_speed);
    if (NEEDS_HISTORY(reference)) return NAN;
    switch (reference) {
    case VR_force: return s->force < 0.0 ? 0.0 : force_change(c, i, d);
    case VR_club_position: return d->x_club;
    case VR_ball_position: return d->x_ball;
    case VR_club_velocity: return v_club;
    case VR_ball_velocity: return d->v_ball;
    case VR_compression:
        return c->state.compression == s->compression ? d->x_club - d->x_ball : 0.0;
    case VR_smash_factor: return is_contact && u ? d->v_ball / u : 0.0;
    case VR_coefficient_of_restitution:
        return is_contact ? (d->v_ball - d->v_club) / (u - p->ball_speed) : 0.0;
    case VR_energy_efficiency: return is_contact && at_touch ? 2.0 * energy / at_touch : 0.0;
    case VR_contact_time: return is_contact ? d->time : 0.0;
    case VR_contact_displacement: return is_contact ? d->x_ball : 0.0;
    case VR_impulse: return is_free ? 0.0 : c->is.is_dragged ? NAN : p->m_ball * d->v_ball;
    case VR_momentum: return p->m_club * v_club + p->m_ball * d->v_ball;
    case VR_kinetic_energy: return energy;
    case VR_club_acceleration: {
        double push = (is_free ? 0.0 : d->club_force) - force_change(c, i, d);
        return (push - drag_change(c, i, d, s->v_club, d->v_club)) / p->m_club;
    }
    case VR_ball_acceleration:
        return (force_change(c, i, d) - drag_change(c, i, d, s->v_ball, d->v_ball)) / p->m_ball;
    case VR_touch_indicator:
        if (!is_free) return 0.0;
        return s->x_ball - s->x_club >= s->v_ball - s->v_club ? d->x_ball - d->x_club
                                                              : d->v_ball - d->club_speed;
    case VR_separation_indicator: return indicator_change(c, i, d);
#if FMI_VERSION == 3
    case VR_time: return d->time;
#endif
    default: return 0.0;
    }
}

/* Whether a variable has directional derivatives. */
static int is_unknown(uint32_t reference)
{
    int place = place_of(reference);
    return place >= SETTABLE && TABLE[place].type == REAL;
}
