/* laws/closed_form.py and numerics/zeros.py: an underdamped linear contact in double precision. */

/* A damping ratio of the drag as small as this changes no bit of any result. */
#define LEAST_DAMPING 1e-30

/* Largest damping ratios in double precision. Under drag the rates may meet beyond; a damper leaves
   hardly an oscillation. */
#define MOST_DRAG 0.7
#define MOST_DAMPING 0.999

/* Largest share of the real mode in the compression: with more, drag moves the bodies together or
   apart much faster than they close, and the real mode and the pair nearly cancel. */
#define MOST_REAL_MODE 0.5

/* Over a shorter time (in units of 1/omega) an integral is Gauss's, since its closed form is the
   small difference of large numbers. */
#define SHORT 0.5

/* A slope (relative to omega times the value) that is smaller may have changed its sign by
   rounding. */
#define FLAT 1e-6

/* Of a value, relative. */
#define ROUNDING 4e-15

/* A zero grazes if the slope there is less than this part of the pair's amplitude. */
#define GRAZING (1.0 / 16.0)

enum { NEWTON_STEPS = 40 };

/* The coefficients (a, c, s) of a quantity, or the rates (r, h, R). */
typedef struct {
    double a, c, s;
} Row;

typedef struct {
    double duration; /* s; 0 where double precision loses digits */
    double rate;     /* 1/s */
    double k, damper, drag, m_club, m_ball, club_force;
    double acceleration; /* of the centre of mass, m/s2 */
    Motion start;
    Row rates, force, d, v_club, v_ball;
    double decay, pair, x_0, x_a, x_c, x_s; /* of the dense output over the angle Rt */
} ClosedForm;

/* ZEROS */

static double length(double a, double b) { return sqrt(a * a + b * b); }

/* x such that r = drag + x is the root between this drag rate and the other, drag + span: by
   Newton's method on (span - x)(p + r x) = q x. */
static double offset_of_real_root(double p, double q, double drag, double span)
{
    double x = p * span, rest = 0.0, rate = 0.0, fall = 1.0, step = 0.0;
    x += x * q * span * (drag + x);
    for (int n = 0; n < NEWTON_STEPS; n++) {
        double slope = p + (drag + x) * x;
        rate = drag + 2.0 * x;
        rest = span - x;
        fall = rest * rate - slope - q;
        step = (rest * slope - q * x) / fall;
        if (fabs(step) <= 3e-6 * fabs(x)) break;
        x -= step;
    }
    /* Chebyshev's correction: what is left is the cube of the step. */
    return x - step * (1.0 + step * (rest - rate) / fall);
}

/* The first downward zero of real e^(growth a) + cosine cos a + sine sin a, rad; 0 if there is none,
   or one that grazes. growth is below 1. */
static double first_downward_zero(double growth, double real, double cosine, double sine)
{
    if (!real) {
        double angle = atan2(cosine, -sine);
        return angle > 0.0 ? angle : angle + 2.0 * PI;
    }
    double maximum = atan2(sine - growth * cosine, cosine + growth * sine);
    double low = larger(maximum, 0.0), high = maximum + PI;
    /* The pair's own zero, where all derivatives are known without another cosine. */
    double angle = PI - atan2(cosine, sine);
    double term = real * exp(growth * angle), rise = growth * term;
    double amplitude = length(cosine, sine), slope = rise - amplitude;
    double step = slope ? term / slope : high;
    if (fabs(step) < 0.1 * angle) angle -= step * (1.0 + 0.5 * step * growth * rise / slope);
    for (int n = 0; n < NEWTON_STEPS; n++) {
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

/* The end of a contact whose force oscillates about a level, rad; 0 where digits are lost. Up to
   half of the pair's amplitude a zero is steep, and the only one of the half period. */
static double end_above(double level, double growth, double cosine, double sine)
{
    double angle = first_downward_zero(growth, level, cosine, sine);
    if (fabs(level) * exp(growth * angle) > 0.5 * length(cosine, sine)) return 0.0;
    return angle;
}

/* SET-UP */

/* Under a damper, or without damping: the centre of mass moves uniformly, or is accelerated. */
static void begin_with_damper(ClosedForm *c, double p, double q, double mu, double zeta)
{
    double omega = c->rate, closing = c->start.closing, d = omega * c->start.compression;
    double level = 0.0, f_a = 0.0;
    if (zeta > MOST_DAMPING) return;
    if (c->club_force) {
        /* The compression oscillates about a level. */
        c->acceleration = c->club_force / (c->m_club + c->m_ball);
        level = p * c->club_force / c->k;
        f_a = p * c->club_force;
        d -= omega * level;
    }
    double h = zeta, second = sqrt((1.0 - zeta) * (1.0 + zeta));
    double w_s = -(h * closing + d) / second, s_0 = (closing + h * d) / second;
    double scale = mu * omega;
    double f_c = scale * (d + 2.0 * zeta * closing), f_s = scale * (s_0 + 2.0 * zeta * w_s);
    double angle = f_a ? end_above(f_a, h / second, f_c, f_s) : atan2(f_c, -f_s);
    double frequency = second * omega, mean = q * c->start.v_club + p * c->start.v_ball;
    c->rates = (Row){0.0, h * omega, frequency};
    c->force = (Row){f_a, f_c, f_s};
    c->d = (Row){level, d / omega, s_0 / omega};
    c->v_club = (Row){mean, p * closing, p * w_s};
    c->v_ball = (Row){mean, -q * closing, -q * w_s};
    c->duration = angle / frequency;
}

/* Under a drag: in units of 1/omega the rates are the roots of s^3 - 2 zeta s^2 + (1 + 4 zeta^2 pq) s
   - 4 zeta pq. One of them, r, lies between the drags 2 zeta p of the club and 2 zeta q of the ball. */
static void begin_with_drag(ClosedForm *c, double p, double q, double zeta)
{
    double omega = c->rate, closing = c->start.closing, d = omega * c->start.compression;
    double v_club = c->start.v_club, v_ball = c->start.v_ball;
    if (zeta > MOST_DRAG || c->club_force) return;
    if (zeta < LEAST_DAMPING) zeta = LEAST_DAMPING;
    double drag_club = 2.0 * zeta * p, drag_ball = 2.0 * zeta * q, total = c->m_club + c->m_ball;
    double span = 2.0 * zeta * ((c->m_club - c->m_ball) / total);
    double x = offset_of_real_root(p, q, drag_club, span), u = p + (drag_club + x) * x;
    /* How far r lies below the ball's drag: the same equation, and no cancellation. */
    double y = q * x / u;
    /* From the slower drag on, where the sum doesn't cancel. */
    double r = x > 0.0 ? drag_club + x : drag_ball - y, h = 0.5 * (drag_club + y);
    double second = sqrt(4.0 * zeta * p * q / r - h * h);
    /* (d, v_club, v_ball) is a (x, p, u), the real mode with the left eigenvector (-q x, q, u), and
       the rest, the pair; (s_0, s_1, s_2) is (A + h) rest / R. */
    double a = (q * (v_club - x * d) + u * v_ball) / (q * (p - x * x) + u * u);
    double a_0 = a * x, a_1 = a * p, a_2 = a * u;
    double c_0 = d - a_0, c_1 = v_club - a_1, c_2 = v_ball - a_2;
    double s_0 = (closing + r * a_0 + h * c_0) / second;
    if (fabs(a_0) > MOST_REAL_MODE * (d + (closing > 0.0 ? closing : 0.0))) return;
    double angle = first_downward_zero((h - r) / second, a_0, c_0, s_0);
    double frequency = second * omega, scale = c->k / omega;
    c->rates = (Row){r * omega, h * omega, frequency};
    c->force = (Row){scale * a_0, scale * c_0, scale * s_0};
    c->d = (Row){a_0 / omega, c_0 / omega, s_0 / omega};
    c->v_club = (Row){a_1, c_1, ((h - drag_club) * c_1 - p * c_0) / second};
    c->v_ball = (Row){a_2, c_2, ((h - drag_ball) * c_2 + q * c_0) / second};
    c->duration = angle / frequency;
}

static void prepare_dense_output(ClosedForm *c)
{
    double r = c->rates.a, h = c->rates.c, frequency = c->rates.s;
    Row v = c->v_club;
    double size = h * h + frequency * frequency;
    c->decay = -r / frequency;
    c->pair = -h / frequency;
    c->x_c = (h * v.c + frequency * v.s) / size;
    c->x_s = (frequency * v.c - h * v.s) / size;
    c->x_0 = c->start.x_club + c->x_c;
    c->x_a = r ? -v.a / r : v.a / frequency;
}

/* Either damper or drag is 0. The duration is 0 where double precision loses digits: the rates
   nearly meet, the real mode nearly cancels the pair, the force hardly reaches 0, or contact doesn't
   end with the first half period; and with a force beside a drag. */
static void closed_form_begin(ClosedForm *c, double k, double damper, double drag, double m_club,
                              double m_ball, Motion start, double club_force)
{
    double total = m_club + m_ball, p = m_ball / total, q = m_club / total, mu = m_club * p;
    memset(c, 0, sizeof *c);
    c->k = k;
    c->damper = damper;
    c->drag = drag;
    c->m_club = m_club;
    c->m_ball = m_ball;
    c->club_force = club_force;
    c->start = start;
    c->rate = sqrt(k / mu);
    double zeta = (damper ? damper : drag) / (2.0 * mu * c->rate);
    if (drag) begin_with_drag(c, p, q, zeta);
    else begin_with_damper(c, p, q, mu, zeta);
    if (c->duration) prepare_dense_output(c);
}

/* The same contact in extended precision. */
static void closed_form_extend(const ClosedForm *c, Extended *x)
{
    extended_begin(x, c->k, c->damper, c->drag, c->m_club, c->m_ball, c->start, c->club_force);
}

/* EVALUATION */

/* The dense output over the angle Rt. */
static State closed_form_dense(const ClosedForm *o, double angle)
{
    double size = exp(o->pair * angle), c = size * cos(angle), s = size * sin(angle);
    double travel = angle, e = 1.0, d, force;
    if (o->decay) {
        travel = expm1(o->decay * angle);
        e = 1.0 + travel;
        d = o->d.a * e + o->d.c * c + o->d.s * s;
        force = o->k * d;
    } else {
        d = o->d.c * c + o->d.s * s;
        force = o->force.c * c + o->force.s * s;
    }
    double x = o->x_0 + o->x_a * travel - o->x_c * c + o->x_s * s;
    double v_club = o->v_club.a * e + o->v_club.c * c + o->v_club.s * s;
    double v_ball = o->v_ball.a * e + o->v_ball.c * c + o->v_ball.s * s;
    if (o->acceleration) {
        double a = o->acceleration, t = angle / o->rates.s;
        force += o->force.a;
        d += o->d.a;
        x += 0.5 * a * t * t;
        v_club += a * t;
        v_ball += a * t;
    }
    return (State){force, x, x - d, v_club, v_ball, d};
}

/* The bodies at the end of contact. */
static Motion closed_form_end(const ClosedForm *o)
{
    double t = o->duration, r = o->rates.a, h = o->rates.c, frequency = o->rates.s;
    double size = exp(-h * t), angle = frequency * t, c = size * cos(angle), s = size * sin(angle);
    double e = r ? 1.0 + expm1(-r * t) : 1.0;
    Row club = o->v_club, ball = o->v_ball;
    double v_club = club.a * e + club.c * c + club.s * s;
    double v_ball = ball.a * e + ball.c * c + ball.s * s;
    double square = h * h + frequency * frequency, x = o->start.x_club - o->start.compression;
    x += ((h * ball.c + frequency * ball.s) * (1.0 - c) + (frequency * ball.c - h * ball.s) * s)
         / square;
    if (r) {
        x -= ball.a / r * expm1(-r * t);
        return (Motion){x, x, v_club, v_ball, 0.0, v_club - v_ball};
    }
    x += ball.a * t;
    double left = o->damper ? o->d.c * c + o->d.s * s : 0.0;
    if (o->acceleration) {
        x += 0.5 * o->acceleration * t * t;
        v_club += o->acceleration * t;
        v_ball += o->acceleration * t;
        left = larger(0.0, o->d.a + o->d.c * c + o->d.s * s);
    }
    double closing = (club.c - ball.c) * c + (club.s - ball.s) * s;
    return (Motion){x + left, x, v_club, v_ball, left, closing};
}

/* The derivative of a row. */
static Row slope_of(Row row, Row rates)
{
    double r = rates.a, h = rates.c, second = rates.s;
    return (Row){-r * row.a, second * row.s - h * row.c, -h * row.s - second * row.c};
}

static double closed_form_at(const ClosedForm *o, Row row, double t)
{
    double size = exp(-o->rates.c * t), angle = o->rates.s * t;
    double pair = row.c * (size * cos(angle)) + row.s * (size * sin(angle));
    return row.a ? row.a * exp(-o->rates.a * t) + pair : pair;
}

static Row closed_form_row(const ClosedForm *o, Quantity quantity)
{
    if (quantity == FORCE) return o->force;
    return quantity == COMPRESSION ? o->d : slope_of(o->d, o->rates);
}

static double closed_form_value(const ClosedForm *o, Quantity quantity, double t)
{
    return closed_form_at(o, closed_form_row(o, quantity), t);
}

static double closed_form_impulse(const ClosedForm *o, double begin, double width)
{
    if (width * o->rate <= SHORT) {
        double end = begin + width, half = 0.5 * width, sum = 0.0;
        for (int n = 0; n < GAUSS_POINTS; n++)
            sum += GAUSS_WEIGHTS[n]
                   * closed_form_at(o, o->force, end - half * (1.0 - GAUSS_NODES[n]));
        return half * sum;
    }
    double r = o->rates.a, h = o->rates.c, frequency = o->rates.s;
    double a = o->force.a, c = o->force.c, s = o->force.s;
    double real = r ? -a * exp(-r * begin) * expm1(-r * width) / r : a * width;
    /* The integral of the pair is a pair. */
    double size = h * h + frequency * frequency;
    Row pair = {0.0, -(h * c + frequency * s) / size, (frequency * c - h * s) / size};
    return real + (closed_form_at(o, pair, begin + width) - closed_form_at(o, pair, begin));
}

/* When a quantity has its maximum, if there is one: before the end of the half period, unless the
   row falls from the start. Returns how many, 0 or 1. */
static int closed_form_maxima(const ClosedForm *o, Quantity quantity, double *when)
{
    Row row = slope_of(closed_form_row(o, quantity), o->rates);
    if (row.a + row.c <= 0.0) return 0;
    double growth = (o->rates.c - o->rates.a) / o->rates.s;
    double angle = first_downward_zero(growth, row.a, row.c, row.s);
    if (angle) {
        *when = angle / o->rates.s;
        return 1;
    }
    /* The slope hardly reaches 0. */
    Extended x;
    closed_form_extend(o, &x);
    return extended_maxima(&x, quantity, when, 1);
}
