/* laws/linear.py: linear contacts, F = k d + damper d', or F = k d and a drag on each body.

   Times are in units of 1/omega, velocities in m/s, D = omega d. The derivation, and why neither of
   the two forms loses digits, is in the Python file. */

/* Extrema between which zeros are searched: later oscillations are smaller, unless beside a level; no
   search for a zero needs so many STEPS. */
enum { FEW = 4, MORE = 45, MOST_EXTREMA = 2000, STEPS = 200, MAXIMA = 24 };

/* ZEROS */

/* The first downward zero of real e^(growth a) + cosine cos a + sine sin a, rad; 0 if there is none, or
   one that grazes. growth is below 1; without a real part the cosine isn't below 0. */
static double first_downward_zero(double growth, double real, double cosine, double sine)
{
    if (!real) return atan2(cosine, -sine);
    double maximum = atan2(sine - growth * cosine, cosine + growth * sine);
    double low = larger(maximum, 0.0), high = maximum + PI;
    /* The pair's own zero, where all derivatives are known without another cosine. */
    double angle = PI - atan2(cosine, sine), amplitude = sqrt(cosine * cosine + sine * sine);
    double term = real * exp(growth * angle), rise = growth * term, slope = rise - amplitude;
    double step = slope ? term / slope : high;
    if (fabs(step) < 0.1 * angle) angle -= step * (1.0 + 0.5 * step * growth * rise / slope);
    for (int n = 0; n < STEPS; n++) {
        if (!(low < angle && angle < high)) return 0.0;
        double c = cos(angle), s = sin(angle), pair = cosine * c + sine * s;
        term = real * exp(growth * angle);
        rise = growth * term;
        slope = rise + sine * c - cosine * s;
        if (slope >= -GRAZING * amplitude) return 0.0;
        step = (term + pair) / slope;
        if (fabs(step) <= 5e-6 * angle) {
            /* The remaining error is of the third order of the step. */
            angle -= step * (1.0 + 0.5 * step * (growth * rise - pair) / slope);
            return low < angle && angle < high ? angle : 0.0;
        }
        angle -= step;
    }
    return 0.0;
}

/* The slower drag, how far the real rate r lies above it, and how far below the faster drag. */
typedef struct {
    double slow, x, y;
} Offsets;

/* p and q are the mass fractions, `unequal` is their difference. With x, r = slow + x, by Newton's
   method on (span - x)(less + r x) = more x. */
static Offsets offsets_of_real_rate(double p, double q, double zeta, double unequal)
{
    double less = p < q ? p : q, more = p < q ? q : p;
    double slow = 2.0 * zeta * less, span = 2.0 * zeta * unequal;
    double low = 0.0, high = span, x = less * span;
    x += x * more * span * (slow + x);
    for (int n = 0; n < STEPS; n++) {
        double rest = span - x, rate = slow + 2.0 * x, grow = less + (slow + x) * x;
        double fall = rest * rate - grow - more;
        /* If it is 0 any step will do: one that leaves the bracket is replaced. */
        if (!fall) fall = -1.0;
        double off = rest * grow - more * x, step = off / fall, bend = step * (rest - rate) / fall;
        if (fabs(step) <= 3e-6 * x && fabs(bend) <= 1e-5) {
            x -= step * (1.0 + bend);
            break;
        }
        /* Where rates meet only the equation itself holds to the last digits. */
        if (fabs(off) <= 1e-15 * more * x) break;
        if (step * fall > 0.0) low = x;
        else high = x;
        x -= step;
        if (!(low <= x && x <= high)) x = 0.5 * (low + high);
    }
    return (Offsets){slow, x, more * x / (less + (slow + x) * x)};
}

/* UNDERDAMPED: separate modes, contact ends within the first half period of the pair */

/* The coefficients of a quantity, a e^(-rt) + c e^(-ht) cos Rt + s e^(-ht) sin Rt; or r, h, R. */
typedef struct {
    double a, c, s;
} Row;

/* A contact; either damper or drag is 0. */
typedef struct {
    double k, damper, drag, m_club, m_ball, club_force;
    Motion start;
} Linear;

typedef struct {
    double duration; /* s; 0 if double precision loses digits in this form */
    double rate;     /* 1/s */
    Linear arguments;
    double acceleration; /* of the centre of mass, m/s2 */
    Row rates, force, d, v_club, v_ball;
    double decay, pair, x_0, x_a, x_c, x_s; /* of the dense output over the angle Rt */
} Underdamped;

/* Under a damper, or without damping: the centre of mass moves uniformly, or is accelerated. Returns
   the angle Rt at the end, or 0. */
static double begin_with_damper(Underdamped *o, double p, double q, double mu, double zeta)
{
    double omega = o->rate, w = o->arguments.start.closing, d = omega * o->arguments.start.compression;
    double club_force = o->arguments.club_force, level = 0.0, f_a = 0.0;
    if (zeta > MOST_DAMPING) return 0.0;
    if (club_force) {
        /* The compression oscillates about a level. */
        o->acceleration = club_force / (o->arguments.m_club + o->arguments.m_ball);
        level = p * club_force / o->arguments.k;
        f_a = p * club_force;
        d -= omega * level;
    }
    double h = zeta, second = sqrt((1.0 - zeta) * (1.0 + zeta));
    double s_d = (w + h * d) / second, s_w = -(h * w + d) / second, scale = mu * omega;
    double f_c = scale * (d + 2.0 * h * w), f_s = scale * (s_d + 2.0 * h * s_w);
    double angle = f_a ? first_downward_zero(h / second, f_a, f_c, f_s) : atan2(f_c, -f_s);
    /* Up to half of the pair's amplitude a zero is steep, and the first one. */
    if (f_a && fabs(f_a) * exp(h / second * angle) > 0.5 * sqrt(f_c * f_c + f_s * f_s)) return 0.0;
    double mean = q * o->arguments.start.v_club + p * o->arguments.start.v_ball;
    o->rates = (Row){0.0, h * omega, second * omega};
    o->force = (Row){f_a, f_c, f_s};
    o->d = (Row){level, d / omega, s_d / omega};
    o->v_club = (Row){mean, p * w, p * s_w};
    o->v_ball = (Row){mean, -q * w, -q * s_w};
    return angle;
}

static double begin_with_drag(Underdamped *o, double p, double q, double zeta)
{
    const Linear *g = &o->arguments;
    double omega = o->rate, w = g->start.closing, d = omega * g->start.compression;
    if (zeta > MOST_DRAG || g->club_force) return 0.0;
    if (zeta < LEAST_DAMPING) zeta = LEAST_DAMPING;
    double unequal = fabs(g->m_club - g->m_ball) / (g->m_club + g->m_ball);
    Offsets offsets = offsets_of_real_rate(p, q, zeta, unequal);
    double x = offsets.x, y = offsets.y, r = offsets.slow + x, h = 0.5 * (offsets.slow + y);
    double second = sqrt(1.0 - x * y - h * h);
    if (p > q) x = -y;
    /* (d, v_club, v_ball) is a (x, p, u), the real mode, with the left eigenvector (-q x, q, u), and
       the pair. x is now how far r lies above the drag of the club. */
    double u = p + r * x, v_club = g->start.v_club, v_ball = g->start.v_ball;
    double a = (q * (v_club - x * d) + u * v_ball) / (q * (p - x * x) + u * u);
    double a_d = a * x, a_club = a * p, a_ball = a * u;
    if (fabs(a_d) > MOST_REAL * (d + (w > 0.0 ? w : 0.0))) return 0.0;
    double c_d = d - a_d, c_club = v_club - a_club, c_ball = v_ball - a_ball;
    double s_d = (w + r * a_d + h * c_d) / second, scale = g->k / omega;
    o->rates = (Row){r * omega, h * omega, second * omega};
    o->force = (Row){scale * a_d, scale * c_d, scale * s_d};
    o->d = (Row){a_d / omega, c_d / omega, s_d / omega};
    o->v_club = (Row){a_club, c_club, ((h - 2.0 * zeta * p) * c_club - p * c_d) / second};
    o->v_ball = (Row){a_ball, c_ball, ((h - 2.0 * zeta * q) * c_ball + q * c_d) / second};
    return first_downward_zero((h - r) / second, a_d, c_d, s_d);
}

static void underdamped_begin(Underdamped *o, Linear given)
{
    double total = given.m_club + given.m_ball, p = given.m_ball / total, q = given.m_club / total;
    double mu = given.m_club * p;
    memset(o, 0, sizeof *o);
    o->arguments = given;
    o->rate = sqrt(given.k / mu);
    double zeta = (given.damper ? given.damper : given.drag) / (2.0 * mu * o->rate);
    double angle = given.drag ? begin_with_drag(o, p, q, zeta) : begin_with_damper(o, p, q, mu, zeta);
    double r = o->rates.a, h = o->rates.c, frequency = o->rates.s;
    if (!angle) return;
    Row v = o->v_club;
    double size = h * h + frequency * frequency;
    o->duration = angle / frequency;
    o->decay = -r / frequency;
    o->pair = -h / frequency;
    o->x_c = (h * v.c + frequency * v.s) / size;
    o->x_s = (frequency * v.c - h * v.s) / size;
    o->x_0 = given.start.x_club + o->x_c;
    o->x_a = r ? -v.a / r : v.a / frequency;
}

/* The dense output over the angle Rt. */
static State underdamped_state(const Underdamped *o, double angle)
{
    double size = exp(o->pair * angle), c = size * cos(angle), s = size * sin(angle);
    double travel = angle, e = 1.0, d, force;
    if (o->decay) {
        travel = expm1(o->decay * angle);
        e = 1.0 + travel;
        d = o->d.a * e + o->d.c * c + o->d.s * s;
        force = o->arguments.k * d;
    } else {
        d = o->d.c * c + o->d.s * s;
        force = o->force.c * c + o->force.s * s;
    }
    double x = o->x_0 + o->x_a * travel - o->x_c * c + o->x_s * s;
    double v_club = o->v_club.a * e + o->v_club.c * c + o->v_club.s * s;
    double v_ball = o->v_ball.a * e + o->v_ball.c * c + o->v_ball.s * s;
    if (o->acceleration) {
        double gain = o->acceleration, t = angle / o->rates.s;
        force += o->force.a;
        d += o->d.a;
        x += 0.5 * gain * t * t;
        v_club += gain * t;
        v_ball += gain * t;
    }
    return (State){force, x, x - d, v_club, v_ball, d};
}

/* The functions that a row has coefficients of. */
static Row underdamped_basis(const Underdamped *o, double t)
{
    double size = exp(-o->rates.c * t), angle = o->rates.s * t;
    return (Row){exp(-o->rates.a * t), size * cos(angle), size * sin(angle)};
}

static double sum_of(Row row, Row basis)
{
    return row.a * basis.a + (row.c * basis.c + row.s * basis.s);
}

/* Velocities of club and ball when contact ends. */
static void underdamped_end_velocities(const Underdamped *o, double *v_club, double *v_ball)
{
    Row b = underdamped_basis(o, o->duration), club = o->v_club, ball = o->v_ball;
    double gained = o->acceleration * o->duration;
    *v_club = club.a * b.a + club.c * b.c + club.s * b.s + gained;
    *v_ball = ball.a * b.a + ball.c * b.c + ball.s * b.s + gained;
}

static double underdamped_at(const Underdamped *o, Row row, double t)
{
    return sum_of(row, underdamped_basis(o, t));
}

static Row underdamped_slope(const Underdamped *o, Row row)
{
    double r = o->rates.a, h = o->rates.c, frequency = o->rates.s;
    return (Row){-r * row.a, frequency * row.s - h * row.c, -h * row.s - frequency * row.c};
}

static double underdamped_value(const Underdamped *o, Quantity quantity, double t)
{
    if (quantity == CLOSING) return underdamped_at(o, underdamped_slope(o, o->d), t);
    return underdamped_at(o, quantity == FORCE ? o->force : o->d, t);
}

static double underdamped_impulse(const Underdamped *o, double begin, double width)
{
    double r = o->rates.a, h = o->rates.c, frequency = o->rates.s;
    double a = o->force.a, c = o->force.c, s = o->force.s;
    double real = r ? -a * exp(-r * begin) * expm1(-r * width) / r : a * width;
    /* The integral of the pair is a pair. */
    double size = h * h + frequency * frequency;
    Row pair = {0.0, -(h * c + frequency * s) / size, (frequency * c - h * s) / size};
    return real + (underdamped_at(o, pair, begin + width) - underdamped_at(o, pair, begin));
}

/* LINEAR: Newton's form of the exponential */

/* The coefficients of C, S, G and H, and of the integral of H. */
typedef struct {
    double e, s, g, j, k;
} Newton;

/* The real rate r; h twice and R, or a, b and (a - b)/2. */
typedef struct {
    double r, lead, trail, second;
    int oscillates, real_first;
} Modes;

/* f' has the coefficients (s - a e, g - b s - c e, j - x g - y s). */
typedef struct {
    double a, b, c, x, y;
} Nodes;

static Modes modes_of(double r, double lead, double trail, double second, int oscillates)
{
    return (Modes){r, lead, trail, second, oscillates, oscillates && r > trail};
}

static Nodes nodes_of(const Modes *m)
{
    double square = m->oscillates ? m->second * m->second : 0.0;
    if (m->real_first) return (Nodes){m->r, m->trail, 0.0, m->trail, square};
    return (Nodes){m->lead, m->trail, square, m->r, 0.0};
}

static double fastest_of(const Modes *m) { return larger(larger(m->r, m->lead + m->trail), 1.0); }

/* Those of a row times e^(slowest rate t): it keeps its zeros, and doesn't underflow. */
static Modes slowed(const Modes *m, Newton row)
{
    /* Without a part in e^(-rt) the slowest rate is one of the pair's, and r has no effect. */
    double slowest = row.j ? 0.0 : row.g ? smaller(m->r, m->trail) : m->trail;
    return modes_of(larger(m->r - slowest, 0.0), m->lead - slowest, m->trail - slowest, m->second,
                    m->oscillates);
}

/* The derivative of a row, with the level lost. */
static Newton slope_of(const Modes *m, Newton f)
{
    Nodes n = nodes_of(m);
    return (Newton){f.s - n.a * f.e, f.g - n.b * f.s - n.c * f.e, f.j - n.x * f.g - n.y * f.s, 0.0, 0.0};
}

/* C and S. */
static void pair_at(const Modes *m, double t, double *c, double *s)
{
    if (m->oscillates) {
        double size = exp(-m->trail * t), angle = m->second * t;
        *c = size * cos(angle);
        *s = size * sin(angle) / m->second;
    } else {
        double gap = 2.0 * m->second;
        *c = exp(-m->lead * t);
        *s = exp(-m->trail * t) * -expm1(-gap * t) / gap;
    }
}

/* The four functions, and the integral of the last one. */
static Newton functions_at(const Modes *m, double t)
{
    double r = m->r, lead = m->lead, trail = m->trail, two_h = lead + trail, product = lead * trail;
    if (m->oscillates) product += m->second * m->second;
    int halvings;
    frexp(fastest_of(m) * t, &halvings);
    for (int i = 0; i < halvings; i++) t *= 0.5;
    /* Power series of G, its derivative n, and its integrals h and k, for a short time. */
    double x = 1.0, y = 0.0, z = 0.0, decay = 1.0, term = t, c, s;
    double g = 0.0, h = 0.0, k = 0.0, n = 0.0, twice = 0.0;
    for (int power = 2; power < 28; power++) {
        n += x * term;
        term *= t / power;
        g += x * term;
        twice += decay * term;
        decay *= -r;
        double longer = term * (t / (power + 1));
        h += x * longer;
        k += x * longer * (t / (power + 2));
        double next = -((two_h + r) * x + (product + r * two_h) * y + r * product * z);
        z = y;
        y = x;
        x = next;
    }
    /* Twice the time, by the motion from there on: u is S' + 2h S, or S' + (a + b) S. */
    pair_at(m, t, &c, &s);
    for (int i = 0; i < halvings; i++) {
        double e = exp(-r * t), once = r ? -expm1(-r * t) / r : t, u = c + lead * s, before = g;
        k = k * (1.0 + u) + t * h + g * twice + s * h;
        h = h * (1.0 + u) + g * (once + s);
        g = g * (e + u) + n * s;
        n = n * (e + c - trail * s) - product * before * s;
        twice = twice * (1.0 + e) + t * once;
        t *= 2.0;
        pair_at(m, t, &c, &s);
    }
    if (m->real_first) return (Newton){exp(-r * t), n + trail * g, g, h, k};
    return (Newton){c, s, g, h, k};
}

/* The integrals of the four functions f, which are those at t. */
static Newton integrals_of(const Modes *m, double t, Newton f)
{
    if (m->real_first) return (Newton){-expm1(-m->r * t) / m->r, f.g + m->trail * f.j, f.j, f.k, 0.0};
    double of_s = f.g + m->r * f.j;
    return (Newton){f.s + m->trail * of_s, of_s, f.j, f.k, 0.0};
}

static double total_of(Newton row, Newton functions)
{
    return row.e * functions.e + row.s * functions.s + row.g * functions.g + row.j * functions.j;
}

static double row_at(const Modes *m, Newton row, double t) { return total_of(row, functions_at(m, t)); }

/* Level, real mode and amplitude of the pair, which oscillates. */
typedef struct {
    double level, real, pair;
} Parts;

static Parts parts_of(const Modes *m, Newton f, double t)
{
    double r = m->r, h = m->trail, apart = h - r, size = apart * apart + m->second * m->second;
    if (m->real_first) {
        f.g += apart * f.s + size * f.e;
        f.s += apart * f.e;
    }
    double level = f.j ? f.j / (r * (h * h + m->second * m->second)) : 0.0;
    double real = (f.j ? f.g - f.j / r : f.g) / size, cosine = f.e - real - level;
    double sine = (f.s - apart * real - h * level) / m->second;
    double pair = sqrt(cosine * cosine + sine * sine);
    return (Parts){level, real * exp(-r * t), pair * exp(-h * t)};
}

/* Whether level and real mode outweigh the pair from t on. */
static int is_settled(const Modes *m, Newton row, double t)
{
    Parts part = parts_of(m, row, t);
    double now = part.level + part.real;
    if (part.pair >= fabs(now) || now * part.level < 0.0) return 0;
    /* The pair decays below the sum of both: faster, or that grows, or the level is enough. */
    return m->r <= m->trail || part.real * part.level < 0.0 || part.pair < fabs(part.level);
}

/* ZEROS OF ROWS: as Python's generators, one after the other */

/* The only zero between low and high, which may be infinite: by Newton's method, or halving. */
static double zero_between(const Modes *m, Newton row, double low, double high, int falls)
{
    Newton slope = slope_of(m, row);
    double t = high == INFINITY ? 2.0 * low + 1.0 / fastest_of(m) : 0.5 * (low + high);
    for (int n = 0; n < STEPS; n++) {
        Newton functions = functions_at(m, t);
        double f = total_of(row, functions), rise = total_of(slope, functions);
        if ((f > 0.0) == falls) low = t;
        else high = t;
        if (high == INFINITY) {
            t *= 2.0;
            continue;
        }
        double step = fabs(f) < (high - low) * fabs(rise) ? f / rise : INFINITY;
        t -= step;
        /* Convergence is quadratic: the next step would be below a double's resolution. By rounding this
           one may leave the bracket. */
        if (fabs(step) <= 1e-10 * t) break;
        if (!(low < t && t < high)) t = 0.5 * (low + high);
    }
    return t;
}

/* The zeros of a row after the start. Between two points there is at most one: zeros of the row without
   its real mode, or with a level those of the slope, which has none. */
typedef struct zeros {
    Modes modes;
    Newton row;
    double low, point; /* the next one of the pair, an angle if it oscillates */
    int most, count, is_positive, is_over;
    struct zeros *of_slope;
} Zeros;

static void zeros_begin(const Modes *given, Zeros *z, Newton row, int most, Zeros *of_slope)
{
    Modes modes = slowed(given, row), *m = &modes;
    Newton slope = slope_of(given, row);
    double start = row.e ? row.e : slope.e ? slope.e : slope_of(given, slope).e;
    *z = (Zeros){modes, row, 0.0, INFINITY, most, 0, start > 0.0, 0, row.j ? of_slope : NULL};
    if (row.j) {
        zeros_begin(given, of_slope, slope, MOST_EXTREMA, NULL);
        return;
    }
    Nodes n = nodes_of(m);
    double e = m->real_first ? row.s : row.s + (n.x - n.a) * row.e, gap = 2.0 * m->second;
    double s = m->real_first ? row.g : row.g + (n.x - n.b) * row.s - n.c * row.e;
    if (!m->oscillates) {
        if (s && e / s < 0.0) z->point = log1p(-gap * (e / s)) / gap;
        return;
    }
    double angle = fmod(atan2(e * m->second, -s), PI);
    if (angle < 0.0) angle += PI;
    if (!angle) angle = PI;
    if (m->real_first) {
        /* Long before, the real mode outweighs the pair, which decays more slowly. */
        Parts part = parts_of(m, row, 0.0);
        if (fabs(part.real) > part.pair && part.pair > 0.0) {
            double after = log(fabs(part.real) / part.pair) / (m->r - m->trail);
            angle += PI * floor(after * m->second / PI);
        }
    }
    z->point = angle;
}

static int next_zero(Refusal *failure, Zeros *z, double *when, int *falls);

/* The next end of an interval; infinite if it is the last. */
static double next_point(Refusal *failure, Zeros *z)
{
    double t = z->point;
    int ignored;
    if (z->of_slope) {
        if (next_zero(failure, z->of_slope, &t, &ignored)) return t;
    } else if (z->modes.oscillates && z->count < z->most) {
        z->point += PI;
        return t / z->modes.second;
    } else if (!z->modes.oscillates && t < INFINITY) {
        z->point = INFINITY;
        return t;
    }
    z->is_over = 1;
    return INFINITY;
}

/* Whether there is another zero; when, and whether f falls there. */
static int next_zero(Refusal *failure, Zeros *z, double *when, int *falls)
{
    Newton row = z->row;
    const Modes *m = &z->modes;
    while (!z->is_over) {
        double low = z->low, high = next_point(failure, z);
        if (failure->reason || (z->is_over && m->oscillates && !row.j)) return 0;
        /* In the end the sign is that of the slowest mode: the level, or the last real one. */
        double last = row.j ? row.j : row.g ? row.g : row.s ? row.s : row.e;
        double later = z->is_over ? last : row_at(m, row, high);
        z->low = high;
        z->count++;
        if (later && (later > 0.0) != z->is_positive) {
            *when = zero_between(m, row, low, high, z->is_positive);
            *falls = z->is_positive;
            z->is_positive = !z->is_positive;
            return 1;
        }
        if (!m->oscillates || z->is_over) continue;
        if (is_settled(m, row, high)) z->is_over = 1;
        else if (z->count == MOST_EXTREMA) {
            *failure = refusal(TOO_MANY_EXTREMA, high, 0.0);
            return 0;
        }
    }
    return 0;
}

/* CONTACT */

typedef struct {
    double duration, rate; /* s, 1/s */
    double p, q, omega, scale, push, gamma, beta, kappa, forced;
    int has_drag;
    Motion start;
    Modes modes;
    Newton force, d, w, v; /* v: of the centre of mass */
    Refusal failure;
} LinearContact;

/* Set the rows, from D, w and the mean velocity. */
static void set_rows(LinearContact *o, double d, double w, double mean)
{
    Nodes n = nodes_of(&o->modes);
    double a = n.a, b = n.b, c = n.c, x = n.x, y = n.y, push = o->push, q = o->q, gamma = o->gamma;
    double rest = gamma - a - b, delta = o->p * q * o->beta, drive = o->beta * mean + push;
    double of_d = o->kappa, of_w = o->kappa * x;
    if (o->modes.real_first) {
        of_d = a * b - 1.0;
        of_w = gamma - x;
    }
    double first = w + a * d, g = of_d * d + of_w * w + drive;
    o->force = o->d = (Newton){d, first, g, o->forced, 0.0};
    o->w = (Newton){w, drive - d + (of_w - b) * w, o->forced - x * g - y * first, 0.0, 0.0};
    double rise = delta * w + (a - gamma) * mean + q * push;
    double bend = (1.0 - y + x * rest) * mean - delta * (d + x * w) + (delta - q * rest) * push;
    o->v = (Newton){mean, rise, bend, q * push, 0.0};
    if (o->has_drag) return;
    double slope = push - d - b * w;
    o->force = (Newton){d + (a + b) * w, b * slope + c * w + a * push, push, 0.0, 0.0};
}

static Modes sorted_modes(double r, double slow, double fast)
{
    double lead = larger(fast, r), trail = larger(slow, smaller(fast, r));
    double half = 0.5 * (lead - trail);
    return modes_of(smaller(slow, r), lead, trail, half ? half : 1e-10 * lead, 0);
}

static void linear_begin(LinearContact *o, Linear given)
{
    double total = given.m_club + given.m_ball, p = given.m_ball / total, q = given.m_club / total;
    double mu = given.m_club * p, omega = sqrt(given.k / mu), r = 0.0, slow = 0.0, fast = 0.0;
    double zeta = (given.damper ? given.damper : given.drag) / (2.0 * mu * omega);
    double two_h = 2.0 * zeta, product = 1.0;
    memset(o, 0, sizeof *o);
    o->p = p;
    o->q = q;
    o->start = given.start;
    o->has_drag = given.drag != 0.0;
    o->omega = omega;
    o->scale = mu * omega;
    o->push = given.club_force / (given.m_club * omega);
    if (given.drag) {
        zeta = larger(zeta, LEAST_DAMPING);
        double unequal = (given.m_club - given.m_ball) / total;
        Offsets offsets = offsets_of_real_rate(p, q, zeta, fabs(unequal));
        slow = offsets.slow;
        fast = slow + offsets.x + offsets.y;
        r = slow + offsets.x;
        two_h = slow + offsets.y;
        o->gamma = 4.0 * zeta * p * q;
        o->beta = 2.0 * zeta * unequal;
        o->forced = 2.0 * zeta * q * o->push;
        /* c - 1, or the same of the two faster ones of three real rates. */
        o->kappa = -offsets.x * offsets.y;
        product = o->gamma / r;
    }
    double h = 0.5 * two_h, square = product - h * h, second = sqrt(fabs(square));
    if (square >= 0.0) {
        o->modes = modes_of(r, h, h, second ? second : 1e-10 * h, 1);
    } else {
        o->modes = sorted_modes(r, product / (h + second), h + second);
        double least = o->modes.r;
        if (least != r) o->kappa = (slow - least) * (fast - least);
    }
    o->rate = fastest_of(&o->modes) * omega;
    double mean = q * given.start.v_club + p * given.start.v_ball;
    set_rows(o, omega * given.start.compression, given.start.closing, mean);
    Zeros zeros, of_slope;
    double t;
    int falls = 0;
    zeros_begin(&o->modes, &zeros, o->force, o->force.j ? MOST_EXTREMA : FEW, &of_slope);
    o->duration = INFINITY;
    while (!falls && next_zero(&o->failure, &zeros, &t, &falls))
        if (falls) o->duration = t / omega;
    o->failure.numbers[0] /= omega;
}

static double linear_value(const LinearContact *o, Quantity quantity, double t)
{
    t *= o->omega;
    if (quantity == FORCE) return o->scale * row_at(&o->modes, o->force, t);
    if (quantity == CLOSING) return row_at(&o->modes, o->w, t);
    return 1.0 / o->omega * row_at(&o->modes, o->d, t);
}

static State linear_state(const LinearContact *o, double t)
{
    t *= o->omega;
    Newton functions = functions_at(&o->modes, t);
    double d = total_of(o->d, functions), w = total_of(o->w, functions);
    double mean = total_of(o->v, functions), force = o->scale * total_of(o->force, functions);
    double moved = total_of(o->v, integrals_of(&o->modes, t, functions));
    double x = o->start.x_club - o->p * o->start.compression + (moved + o->p * d) / o->omega;
    d /= o->omega;
    return (State){force, x, x - d, mean + o->p * w, mean - o->q * w, d};
}

static double linear_impulse(const LinearContact *o, double begin, double width)
{
    LinearContact later = *o;
    Newton functions = functions_at(&o->modes, o->omega * begin);
    set_rows(&later, total_of(o->d, functions), total_of(o->w, functions), total_of(o->v, functions));
    width *= o->omega;
    Newton integrals = integrals_of(&o->modes, width, functions_at(&o->modes, width));
    return o->scale / o->omega * total_of(later.force, integrals);
}

/* When a quantity has maxima inside the phase, in order; returns how many. */
static int linear_maxima(const LinearContact *o, Quantity quantity, double when[MAXIMA])
{
    Newton row = quantity == FORCE ? o->force : o->d;
    /* Without drag the first is the largest; of equal ones rounding would choose. */
    int falls, count = 0, most = o->has_drag ? MAXIMA : 1;
    Refusal failure = ACCEPTED;
    Zeros zeros;
    double t;
    zeros_begin(&o->modes, &zeros, slope_of(&o->modes, row), row.j ? MORE : FEW, NULL);
    while (count < most && next_zero(&failure, &zeros, &t, &falls))
        if (falls && t <= o->omega * o->duration) when[count++] = t / o->omega;
    return count;
}

/* When a quantity has maxima; returns how many. The only one is before the end of the half period,
   unless the row falls from the start. */
static int underdamped_maxima(const Underdamped *o, Quantity quantity, double when[MAXIMA])
{
    Row row = underdamped_slope(o, quantity == FORCE ? o->force : o->d);
    if (row.a + row.c <= 0.0) return 0;
    double growth = (o->rates.c - o->rates.a) / o->rates.s;
    double angle = first_downward_zero(growth, row.a, row.c, row.s);
    if (angle) {
        *when = angle / o->rates.s;
        return 1;
    }
    LinearContact contact;
    linear_begin(&contact, o->arguments);
    return linear_maxima(&contact, quantity, when);
}
