/* laws/power_law.py: a spring that stiffens and a matching damper (n > 1).

   F = k d_r (d/d_r)^n + b (d/d_r)^((n-1)/2) d'. With m = (n+1)/2, x = (d/L)^m is a linear damped
   oscillator in a scaled time sigma, dsigma = omega (d/L)^(m-1) dt: x' = u, u' = -x - 2 zeta u. All is
   closed form in sigma; only the time, the integral of x^((1-m)/m) dsigma / omega, is tabulated. */

/* Panels meet at the cuts of variables.h, phases since the last zero of x. Its other zeros (pi apart,
   along the imaginary axis above critical damping) are so far away that coefficients fall as 7^-j or
   faster. */
enum {
    CUTS_BELOW = sizeof CUTS_BELOW_CRITICAL / sizeof *CUTS_BELOW_CRITICAL,
    CUTS_ABOVE = sizeof CUTS_ABOVE_CRITICAL / sizeof *CUTS_ABOVE_CRITICAL,
    MOST_PANELS = CUTS_ABOVE + 1
};

/* The motion x' = u, u' = -x - 2 zeta u, whichever way it is damped. */
typedef struct {
    double zeta, slow, fast, frequency;
    int oscillates;
} Oscillator;

typedef struct {
    double x, u, drive; /* drive is x + 2 zeta u */
} Phase;

/* An interval of sigma on which time is a series. It is expanded about a zero of x or, away from
   those, about its own beginning; s is the sigma from there, H the largest |s|, |s| = H v^r. */
typedef struct {
    double x, u; /* at s = 0 */
    double r, width, sigma, direction, reach, stop;
    double t_origin, end; /* when s = 0, and when the panel ends, s since the start of the phase */
    double series[ORDER];
    int at_zero;
} Panel;

typedef struct {
    double duration;
    Motion start;
    Oscillator motion;
    double x, u; /* at the start */
    double p, q, mu, m, power, length, speed, omega;
    double initial[3], final[3]; /* contact force, compression, closing speed */
    int count;
    Panel panels[MOST_PANELS];
} PowerLaw;

/* OSCILLATOR */

static Oscillator oscillator(double zeta)
{
    Oscillator o = {zeta, zeta, zeta, 0.0, zeta <= 1.0};
    if (o.oscillates) {
        /* Exactly critical: a frequency this small changes nothing within a double. */
        o.frequency = sqrt((1.0 - zeta) * (1.0 + zeta));
        if (!o.frequency) o.frequency = 1e-10;
    } else {
        o.frequency = sqrt(zeta - 1.0) * sqrt(zeta + 1.0);
        o.fast = zeta + o.frequency;
        o.slow = 1.0 / o.fast;
    }
    return o;
}

/* (C, S) = e^(-zeta sigma) (cos R sigma, sin R sigma / R) up to critical damping; beyond, with the
   rates l_1 < l_2 and D = l_2 - l_1 = 2R, e^(-l_1 sigma) (1, (1 - e^(-D sigma))/D). */
static void oscillator_basis(const Oscillator *o, double sigma, double *c, double *s)
{
    double decay = exp(-o->slow * sigma);
    if (o->oscillates) {
        double phase = o->frequency * sigma;
        *c = decay * cos(phase);
        *s = decay * sin(phase) / o->frequency;
        return;
    }
    double split = 2.0 * o->frequency;
    *c = decay;
    *s = decay * -expm1(-split * sigma) / split;
}

/* A time sigma after this x and u. */
static Phase oscillator_after(const Oscillator *o, double x, double u, double sigma)
{
    double slow = o->slow, fast = o->fast, c, s;
    oscillator_basis(o, sigma, &c, &s);
    double x_after = x * c + (u + slow * x) * s;
    if (fast > 2.0 * slow) {
        /* Their own terms, so that u and the force stay exact when the faster one has died out. */
        double slow_term = slow * (u + fast * x) / (fast - slow) * c;
        double fast_term = fast * (u + slow * x) / (fast - slow) * exp(-fast * sigma);
        return (Phase){x_after, fast_term - slow_term, fast * fast_term - slow * slow_term};
    }
    double drive = x + 2.0 * o->zeta * u;
    return (Phase){x_after, u * c - (x + fast * u) * s, drive * c + (u - fast * drive) * s};
}

/* sigma from tan(R sigma)/R or tanh(R sigma)/R; slow_part is denominator - R numerator, for tanh. */
static double oscillator_until(const Oscillator *o, double numerator, double denominator,
                               double slow_part)
{
    if (o->oscillates) return atan2(o->frequency * numerator, denominator) / o->frequency;
    double split = 2.0 * o->frequency;
    return log1p(split * numerator / slow_part) / split;
}

/* PANELS */

/* x/|s| or x: what is far from zero all over the panel. */
static double panel_ratio(const Panel *p, const Oscillator *o, double s)
{
    double c, basis_s;
    oscillator_basis(o, s, &c, &basis_s);
    if (p->at_zero) return s ? fabs(p->u * (basis_s / s)) : fabs(p->u);
    return p->x * c + (p->u + o->slow * p->x) * basis_s;
}

/* Time to or from s = 0, s. */
static double panel_clock(const Panel *p, double omega, double v)
{
    return p->reach / omega * v * evaluate(p->series, ORDER, 2.0 * pow(v, p->r) - 1.0);
}

static double panel_time_to(const Panel *p, double omega, double s)
{
    return p->direction * panel_clock(p, omega, pow(s / p->width, 1.0 / p->r));
}

/* The v at a time since the start of the phase; time over v hardly bends for Newton. */
static double panel_find(const Panel *p, const PowerLaw *o, double t)
{
    double clock = p->direction * (t - p->t_origin), power = (1.0 - o->m) / o->m;
    double v = smaller(1.0, clock / panel_clock(p, o->omega, 1.0));
    for (int n = 0; n < 20; n++) {
        double ratio = panel_ratio(p, &o->motion, p->width * pow(v, p->r));
        double slope = pow(ratio, power) * p->r * p->reach / o->omega;
        double step = (panel_clock(p, o->omega, v) - clock) / slope;
        /* A subnormal time has few digits: v mustn't fall below 0 for that. */
        v = larger(v - step, 0.5 * v);
        /* Convergence is quadratic: the next step would be below a double's resolution. */
        if (fabs(step) <= 1e-9 * v) break;
    }
    return v;
}

/* SET-UP */

/* Contact force, N, from d/L and x + 2 zeta u. */
static double power_law_force(const PowerLaw *o, double relative, double drive)
{
    double scale = o->mu * o->omega * o->speed;
    double force = scale * pow(relative, o->m - 1.0) * drive;
    return force > 0.0 ? force : 0.0;
}

/* The panel from one sigma to another, which begins at the time t: of sigmas since the last zero of x,
   `past`, and until the next one, `left` after the end. */
static Panel panel_between(const PowerLaw *o, double begin, double stop, double past, double end,
                           double left, double t)
{
    const Oscillator *motion = &o->motion;
    double width = stop - begin, after = left + (end - stop), first = 0.0, last = width, zero = begin;
    int at_zero = 1;
    if (past + begin < NEAR * width) {
        zero = -past;
        first = past + begin;
        last = past + stop;
    } else if (after < NEAR * width) {
        zero = end + left;
        first = -(after + width);
        last = -after;
    } else {
        at_zero = 0;
    }
    Phase origin = oscillator_after(motion, o->x, o->u, zero);
    Panel p = {.x = at_zero ? 0.0 : origin.x, .u = origin.u, .stop = stop, .at_zero = at_zero};
    p.r = at_zero ? o->m : 1.0;
    p.width = last > 0.0 ? last : first;
    p.sigma = stop - last;
    p.direction = p.width > 0.0 ? 1.0 : -1.0;
    p.reach = pow(fabs(p.width), 1.0 / p.r);
    double power = (1.0 - o->m) / o->m, values[ORDER], g[ORDER];
    for (int n = 0; n < ORDER; n++)
        values[n] = pow(panel_ratio(&p, motion, 0.5 * p.width * (1.0 + NODES[n])), power);
    interpolate(values, g);
    /* (1 + z) T_j' = j T_j + 2j (T_(j-1) + T_(j-2) + ... + T_0 / 2): solved from the top. Series list
       their coefficients from the highest order down. */
    double above = 0.0;
    for (int j = ORDER - 1; j > 0; j--) {
        double coefficient = (g[ORDER - 1 - j] - 2.0 * above) / (j + 1.0 / p.r);
        above += j * coefficient;
        p.series[ORDER - 1 - j] = coefficient;
    }
    p.series[ORDER - 1] = (g[ORDER - 1] - above) * p.r;
    p.t_origin = t - panel_time_to(&p, o->omega, first);
    p.end = p.t_origin + panel_time_to(&p, o->omega, last);
    return p;
}

/* Make the panels; return u at the end of contact. */
static double lay_out(PowerLaw *o)
{
    const Oscillator *motion = &o->motion;
    double zeta = motion->zeta, slow = motion->slow, frequency = motion->frequency;
    double x = o->x, u = o->u, left = INFINITY, begin = 0.0, t = 0.0;
    /* sigma from the last zero of x to the start, and on to the end; on to the next zero: left. */
    double past = oscillator_until(motion, x, u + zeta * x, u + slow * x);
    double end = oscillator_until(motion, x + 2.0 * zeta * u,
                                  zeta * x + (2.0 * zeta * zeta - 1.0) * u, slow * (x + slow * u));
    const double *cuts = CUTS_ABOVE_CRITICAL;
    int count = CUTS_ABOVE;
    if (motion->oscillates) {
        left = atan2(2.0 * zeta * frequency, 1.0 - 2.0 * zeta * zeta) / frequency;
        cuts = CUTS_BELOW_CRITICAL;
        count = CUTS_BELOW;
    }
    for (int n = 0; n <= count; n++) {
        double stop = n < count ? cuts[n] / frequency - past : end;
        if (n < count && !(0.0 < stop && stop < end)) continue;
        o->panels[o->count] = panel_between(o, begin, stop, past, end, left, t);
        t = o->panels[o->count++].end;
        begin = stop;
    }
    return oscillator_after(motion, x, u, end).u;
}

/* From a start without a force, and not of a first touch, the phase has duration 0. */
static void power_law_begin(PowerLaw *o, const Parameters *p, double k, double b, Motion start)
{
    double d = start.compression, w = start.closing, total = p->m_club + p->m_ball;
    double d_r = p->reference_compression, n = p->exponent;
    memset(o, 0, sizeof *o);
    o->start = start;
    o->p = p->m_ball / total;
    o->q = p->m_club / total;
    o->mu = p->m_club * o->p;
    o->m = 0.5 * (n + 1.0);
    o->power = (n - 1.0) / (n + 1.0);
    double omega = sqrt(o->m * (k / o->mu)), speed = fabs(w);
    o->motion = oscillator(b / (2.0 * o->mu * omega));
    /* L is what the speed could compress to, or the compression: of x and |u| one is 1. */
    double reach = pow(o->m * speed / omega, 1.0 / o->m) * pow(d_r, o->power);
    if (reach >= d) {
        omega = o->m * speed / reach;
    } else {
        reach = d;
        omega *= pow(d / d_r, o->m - 1.0);
        speed = reach * omega / o->m;
    }
    o->omega = omega;
    o->length = reach;
    o->speed = speed;
    o->u = w / speed;
    o->x = pow(d / reach, o->m);
    double zeta = o->motion.zeta, drive = o->x + 2.0 * zeta * o->u;
    o->initial[FORCE] = power_law_force(o, d / reach, drive);
    o->initial[COMPRESSION] = d;
    o->initial[CLOSING] = w;
    if (drive > 0.0 || (o->x == 0.0 && o->u > 0.0)) {
        double u = lay_out(o);
        d = reach * pow(-2.0 * zeta * u, 1.0 / o->m);
        w = speed * u;
    }
    o->final[COMPRESSION] = d;
    o->final[CLOSING] = w;
    o->duration = o->count ? o->panels[o->count - 1].end : 0.0;
}

/* EVALUATION */

/* Contact force (N), compression (m) and closing speed (m/s). */
static void relative_motion(const PowerLaw *o, double t, double values[3])
{
    if (!(t > 0.0) || t >= o->duration) {
        memcpy(values, t >= o->duration ? o->final : o->initial, sizeof o->final);
        return;
    }
    const Panel *p = o->panels;
    while (!(t < p->end)) p++;
    double v = panel_find(p, o, t), s = p->width * pow(v, p->r), relative;
    Phase now = oscillator_after(&o->motion, p->x, p->u, s);
    if (p->at_zero) relative = p->reach * v * pow(panel_ratio(p, &o->motion, s), 1.0 / o->m);
    else relative = pow(now.x, 1.0 / o->m);
    values[FORCE] = power_law_force(o, relative, now.drive);
    values[COMPRESSION] = o->length * relative;
    values[CLOSING] = o->speed * now.u;
}

static State power_law_state(const PowerLaw *o, double t)
{
    double values[3], p = o->p, q = o->q;
    Motion s = o->start;
    relative_motion(o, t, values);
    double d = values[COMPRESSION], fallen = s.closing - values[CLOSING];
    double x = s.x_club + ((p * s.v_ball + q * s.v_club) * t - p * (s.compression - d));
    return (State){values[FORCE], x, x - d, s.v_club - p * fallen, s.v_ball + q * fallen, d};
}

static double power_law_value(const PowerLaw *o, Quantity quantity, double t)
{
    double values[3];
    relative_motion(o, t, values);
    return values[quantity];
}

/* sigma from the start of the phase until t. */
static double sigma_until(const PowerLaw *o, double t)
{
    if (t <= 0.0) return 0.0;
    for (int n = 0; n < o->count; n++) {
        const Panel *p = &o->panels[n];
        if (t < p->end) return p->sigma + p->width * pow(panel_find(p, o, t), p->r);
    }
    return o->panels[o->count - 1].stop;
}

static double power_law_impulse(const PowerLaw *o, double begin, double width)
{
    if (!o->count) return 0.0;
    const Oscillator *motion = &o->motion;
    double x = o->x, u = o->u, scale = o->mu * o->speed;
    double first = sigma_until(o, begin), last = sigma_until(o, begin + width), span = last - first;
    if (span * larger(1.0, motion->fast) > 0.1)
        return scale * (oscillator_after(motion, x, u, first).u - oscillator_after(motion, x, u, last).u);
    /* The integral of F dt is that of (x + 2 zeta u) dsigma up to a factor. Over a short time the
       rounding of sigma cancels in the quotient of that and of t, the integral of x^(-P) dsigma (not
       smooth at x = 0, but sigma is exact there). */
    double drive = 0.0, time = 0.0, x_at[GAUSS_POINTS], most = 0.0, fewest = INFINITY;
    for (int n = 0; n < GAUSS_POINTS; n++) {
        double sigma = first + (0.5 + 0.5 * GAUSS_NODES[n]) * span;
        Phase now = oscillator_after(motion, x, u, sigma);
        drive += 0.5 * GAUSS_WEIGHTS[n] * now.drive;
        x_at[n] = now.x;
        most = larger(most, now.x);
        fewest = smaller(fewest, now.x);
    }
    if (most >= 1.15 * fewest) return scale * drive * span;
    for (int n = 0; n < GAUSS_POINTS; n++)
        time += 0.5 * GAUSS_WEIGHTS[n] * pow(x_at[n], -o->power);
    return scale * o->omega * width * drive / time;
}

/* When a quantity has its maximum, if there is one; returns how many, 0 or 1. */
static int power_law_maxima(const PowerLaw *o, Quantity quantity, double *when)
{
    const Oscillator *motion = &o->motion;
    double x = o->x, u = o->u, zeta = motion->zeta, power = o->power, r = 0.0;
    if (quantity == FORCE) {
        /* F' = 0 is 2 zeta P r^2 + (1 + P - 4 zeta^2) r - 2 zeta = 0 with r = u/x, which only falls: F
           rises until r is at the root that isn't negative (the other is beyond the end). */
        double half = 0.5 * (1.0 + power) - 2.0 * zeta * zeta;
        double other = 2.0 * zeta * sqrt(power), root = sqrt(half * half + other * other);
        r = half > 0.0 ? 2.0 * zeta / (half + root) : (root - half) / (2.0 * zeta * power);
    }
    if (u <= r * x || !o->count) return 0;
    /* sigma until u/x has fallen to r. */
    double sigma = oscillator_until(motion, u - r * x, x + motion->zeta * u + r * (u + zeta * x),
                                    x * (1.0 + r * motion->fast) + u * (motion->slow + r));
    int n = 0;
    while (n < o->count - 1 && !(sigma < o->panels[n].stop)) n++;
    const Panel *p = &o->panels[n];
    *when = p->t_origin + panel_time_to(p, o->omega, sigma - p->sigma);
    return 1;
}
