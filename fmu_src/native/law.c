/* laws/law.py, absolute.py, relative.py and restitution.py: the contact laws.

   Law 1, absolute: F = k d, and a drag b v on each body. Law 2, relative: F = k d + b d', or the power
   law of these; damping may follow from a coefficient of restitution that falls with the approach
   speed. */

enum { ABSOLUTE = 1, RELATIVE = 2 };

/* The damping ratio zeta for a coefficient of restitution above 0 and at most 1: by Newton's method on
   zeta s(zeta) = -ln(COR)/2, concave and rising, so that every iterate stays below the root. */
static double damping_ratio(double coefficient)
{
    double half = -0.5 * log(coefficient), zeta = fabs(2.0 * half / PI);
    for (int n = 0; n < 100; n++) {
        double square = (zeta - 1.0) * (zeta + 1.0), s = 1.0, slope = -1.0 / 3.0;
        if (square) {
            double root = sqrt(fabs(square));
            s = (square < 0.0 ? atan2(root, zeta) : asinh(root)) / root;
            slope = (1.0 - zeta * s) / square;
        }
        double step = (half - zeta * s) / (s + zeta * slope);
        zeta += step;
        if (step <= 4e-16 * zeta) break;
    }
    return zeta;
}

/* The damping that acts, N.s/m, in a contact with this approach speed, m/s. */
static double law_damping(const Parameters *p, double k, double b, double closing)
{
    if (!p->restitution_at_rest) return b;
    /* Outputs may be read before a step is refused for a coefficient out of range. */
    double coefficient = p->restitution_at_rest - p->restitution_slope * closing;
    double zeta = damping_ratio(larger(coefficient, LEAST_RESTITUTION));
    double mu = p->m_club * (p->m_ball / (p->m_club + p->m_ball));
    return 2.0 * zeta * mu * sqrt(0.5 * (p->exponent + 1.0) * (k / mu));
}

/* Why a contact is refused beside the force on the club head: that leaves few digits for this approach
   speed. */
static Refusal refusal_of_push(const Parameters *p, Inputs inputs, double closing)
{
    double n = p->exponent, d_r = p->reference_compression, force = inputs.club_force;
    double share = p->m_ball / (p->m_club + p->m_ball), rate = closing / d_r;
    /* Of the compression that the energy leads to, relative to d_r, the power n + 1. */
    double power = 0.5 * (n + 1.0) * (p->m_club * share / inputs.k) * rate * rate;
    double contact_force = inputs.k * d_r * pow(power, n / (n + 1.0));
    double most = n == 1.0 ? MOST_PUSH : MOST_PUSH_OF_POWER_LAW;
    if (share * fabs(force) <= most * contact_force) return ACCEPTED;
    return (Refusal){LARGE_PUSH, place_of(VR_club_force), {force, most, contact_force}, FINE};
}

/* The coefficient of the closing speed in the force, N.s/m. */
static double law_damper(const Parameters *p, double b) { return p->law == RELATIVE ? b : 0.0; }

/* The coefficient of the drag on each body, N.s/m. */
static double law_drag(const Parameters *p, double b) { return p->law == RELATIVE ? 0.0 : b; }

/* Contact force, N, from the compression, m, and its rate of change, m/s; it continues smoothly below
   zero force and zero compression. */
static double law_force(const Parameters *p, double k, double b, double compression, double closing)
{
    double n = p->exponent;
    if (n == 1.0) return k * compression + law_damper(p, b) * closing;
    double power = pow(fabs(compression) / p->reference_compression, 0.5 * (n - 1.0));
    return power * (k * power * compression + b * closing);
}
