/* laws/extended.py: any linear contact in extended precision, where double precision loses digits.

   A linear contact has F = k d + damper d' and a drag on each body, with the compression d:

       m_C v_C' = -F - drag v_C,  m_B v_B' = F - drag v_B,  d' = w = v_C - v_B.

   It has one real rate -r (0 without drag) and a pair of rates -h +- iR. Every quantity is a row
   (a, c, s): a e^(-rt) + c e^(-ht) cos Rt + s e^(-ht) sin Rt, with cosh and sinh where R^2 < 0. The
   derivation, and why none of the zeros is missed, is in the Python file. */

/* A row beside a level has maxima in so many times the window. */
#define MORE 15.0

/* A smaller damping ratio is replaced by this one, and a pair of rates that are nearer (relative,
   squared) by two real ones so far apart: that changes no bit of any result. */
#define APART 1e-30

/* Halley's method takes a shorter step (relative) only once the next one would be below 1e-50. */
#define ZERO_TOLERANCE 1e-17

/* So many extrema of the force are examined for the end of a contact under a force. */
enum { MAXIMA = 24, MOST_EXTREMA = 2000 };

typedef struct {
    Big a, c, s;
} BigRow;

typedef struct {
    double duration, rate; /* s; the fastest rate of change, 1/s */
    Failure failure;
    Motion start;
    int oscillates;
    BigRow rates; /* r, h, R */
    Big fast, slow, window;
    BigRow force, d, w, mean; /* the velocity of the centre of mass */
    Big level, force_level, drift;
    Big first_force, d_0, mean_0;
    Big drag, total, m_ball, q, club_force;
} Extended;

/* ZEROS (numerics/zeros.py) */

/* A function and its first two derivatives. */
typedef struct {
    Big f, slope, bend;
} Derivatives;

typedef Derivatives (*Function)(const void *context, Big t);

/* The only zero between low >= 0 and high, by Halley's method; where that fails, by halving. f falls
   if it is above 0 just after low and below 0 at high. */
static Big zero_between(Function function, const void *context, Big low, Big high, int falls)
{
    Big t = scaled(plus(low, high), -1), before = high, half = scaled(ONE, -1);
    for (;;) {
        Derivatives at = function(context, t);
        if ((at.f.sign > 0) == falls) low = t;
        else high = t;
        Big step = high;
        if (at.slope.sign) {
            step = over(at.f, at.slope);
            /* Far from the zero the bend may mislead. */
            Big bend = over(times(scaled(step, -1), at.bend), at.slope);
            step = over(step, greatest(half, minus(ONE, bend)));
        }
        Big next = minus(t, step);
        if (!below(by(t, ZERO_TOLERANCE), magnitude(step))) return least(greatest(next, low), high);
        if (below(low, next) && below(next, high) && !below(before, scaled(magnitude(step), 1))) {
            before = magnitude(step);
            t = next;
            continue;
        }
        /* Where the bracket is wide, its exponent is halved. */
        Big middle = below(high, scaled(low, 4)) ? scaled(plus(low, high), -1)
                                                 : root(times(greatest(low, scaled(high, -20)), high));
        if (!compare(middle, t) || !below(low, middle) || !below(middle, high)) return middle;
        t = middle;
        before = high;
    }
}

/* ROWS */

/* b or -b where the pair of rates is real: cosh and sinh instead of cos and sin. */
static Big with_sign(const Extended *x, Big b) { return x->oscillates ? b : negative(b); }

/* The derivative of a row. */
static BigRow row_slope(const Extended *x, BigRow row)
{
    Big r = x->rates.a, h = x->rates.c, second = x->rates.s;
    return (BigRow){negative(times(r, row.a)), minus(times(second, row.s), times(h, row.c)),
                    minus(negative(times(h, row.s)), with_sign(x, times(second, row.c)))};
}

/* The three functions that a row has coefficients of. */
static BigRow basis(const Extended *x, Big t)
{
    Big e = exponential(negative(times(x->rates.a, t)));
    Big slow = exponential(negative(times(x->slow, t))), cosine = ZERO, sine = ZERO;
    if (x->oscillates) {
        /* Once nothing is left, the angle may exceed its digits. */
        if (slow.sign) cosine_sine(times(x->rates.s, t), &cosine, &sine);
        return (BigRow){e, times(slow, cosine), times(slow, sine)};
    }
    Big fast = exponential(negative(times(x->fast, t)));
    return (BigRow){e, scaled(plus(slow, fast), -1), scaled(minus(slow, fast), -1)};
}

static Big row_with(BigRow b, BigRow row)
{
    return plus(plus(times(row.a, b.a), times(row.c, b.c)), times(row.s, b.s));
}

static Big row_at(const Extended *x, Big t, BigRow row) { return row_with(basis(x, t), row); }

static BigRow row_of(const Extended *x, Quantity quantity)
{
    return quantity == FORCE ? x->force : quantity == COMPRESSION ? x->d : x->w;
}

static Big level_of(const Extended *x, Quantity quantity)
{
    return quantity == FORCE ? x->force_level : quantity == COMPRESSION ? x->level : ZERO;
}

/* A row beside a level, with its derivatives. */
typedef struct {
    const Extended *x;
    BigRow row, slope, bend;
    Big level;
} LevelledRow;

static Derivatives levelled_row(const void *context, Big t)
{
    const LevelledRow *l = context;
    BigRow b = basis(l->x, t);
    return (Derivatives){plus(l->level, row_with(b, l->row)), row_with(b, l->slope),
                         row_with(b, l->bend)};
}

static Big row_zero(const Extended *x, BigRow row, Big low, Big high, int falls, Big level)
{
    BigRow slope = row_slope(x, row);
    LevelledRow levelled = {x, row, slope, row_slope(x, slope), level};
    return zero_between(levelled_row, &levelled, low, high, falls);
}

/* SIGN CHANGES: as Python's generators, one after the other. */

/* The extrema of e^(rt) f, s, in order. */
typedef struct {
    Big angle, second, only;
    int oscillates, left;
} Extrema;

static Extrema extrema(const Extended *x, BigRow row)
{
    Extrema e = {BIG_PI, x->rates.s, ZERO, x->oscillates, 0};
    Big rise = minus(x->rates.a, x->rates.c), second = x->rates.s;
    /* (e^(rt) f)' is e^((r-h)t) (u cos Rt + v sin Rt). */
    Big u = plus(times(rise, row.c), times(second, row.s));
    Big v = minus(times(rise, row.s), with_sign(x, times(second, row.c)));
    if (!x->oscillates) {
        Big sum = plus(v, u), difference = minus(v, u);
        if (compare_magnitudes(&sum, &difference) < 0 && sum.sign * difference.sign > 0) {
            e.left = 1;
            e.only = over(big(logarithm(over(difference, sum))), scaled(second, 1));
        }
        return e;
    }
    Big size = greatest(magnitude(u), magnitude(v));
    if (size.sign) {
        /* Double precision suffices for the ends of brackets. */
        double angle = fmod(atan2(as_double(over(u, size)), -as_double(over(v, size))), PI);
        if (angle < 0.0) angle += PI;
        e.angle = angle ? big(angle) : big(PI);
    }
    return e;
}

static int next_extremum(Extrema *e, Big *t)
{
    if (!e->oscillates) {
        *t = e->only;
        return e->left-- > 0;
    }
    *t = over(e->angle, e->second);
    e->angle = plus(e->angle, BIG_PI);
    return 1;
}

/* The zeros of a row, beside a level, up to an end. */
typedef struct sign_changes {
    BigRow row;
    Big end, level, low, last;
    int is_positive, examined; /* extrema */
    Extrema points;
    struct sign_changes *of_slope; /* with a level the extrema are the zeros of the slope */
} SignChanges;

static SignChanges sign_changes(const Extended *x, BigRow row, Big end, Big level,
                                SignChanges *of_slope)
{
    SignChanges c = {row, end, level, ZERO, level, 0, 0, {ZERO, ZERO, ZERO, 0, 0}, of_slope};
    BigRow slope = row_slope(x, row), bend = row_slope(x, slope);
    Big starts[3] = {level.sign ? x->first_force : plus(row.a, row.c), plus(slope.a, slope.c),
                     plus(bend.a, bend.c)};
    for (int n = 2; n >= 0; n--)
        if (starts[n].sign) c.is_positive = starts[n].sign > 0;
    if (level.sign) {
        *of_slope = sign_changes(x, slope, end, ZERO, NULL);
    } else {
        c.of_slope = NULL;
        c.points = extrema(x, row);
        /* A number with the sign of f after a long time, for a pair of real rates. One of them is
           the slowest: from half of their sum Halley's method finds the largest of three roots. */
        c.last = plus(row.c, row.s);
    }
    return c;
}

/* Whether an oscillating row and a level keep their sign after t, s. */
static int is_settled(const Extended *x, BigRow row, Big level, Big t)
{
    Big r = x->rates.a, h = x->rates.c;
    if (!(x->oscillates && t.sign) || (!level.sign && !below(r, h))) return 0;
    Big real = times(row.a, exponential(negative(times(r, t))));
    /* Its amplitude: a bound above it would never be reached without damping. */
    Big amplitude = root(plus(times(row.c, row.c), times(row.s, row.s)));
    Big pair = times(amplitude, exponential(negative(times(h, t))));
    if (!level.sign) return below(pair, magnitude(real));
    Big now = plus(level, real);
    if (now.sign * level.sign <= 0 || !below(pair, magnitude(now))) return 0;
    /* The pair decays below the sum of both: faster, or that grows, or the level is enough. */
    return !below(h, r) || real.sign * level.sign <= 0 || below(pair, magnitude(level));
}

static Big levelled(const Extended *x, const SignChanges *c, Big t)
{
    return plus(c->level, row_at(x, t, c->row));
}

/* Where there are too many extrema, with or without a level. */
static const SignChanges *given_up(const SignChanges *c)
{
    if (c->examined == MOST_EXTREMA) return c;
    return c->of_slope ? given_up(c->of_slope) : NULL;
}

/* Whether there is another zero; when, s, and whether f falls there. */
static int next_sign_change(const Extended *x, SignChanges *c, Big *when, int *falls)
{
    while (below(c->low, c->end)) {
        if (is_endless(c->end) && is_settled(x, c->row, c->level, c->low)) return 0;
        Big high = c->end, point;
        int ignored;
        if (c->of_slope ? next_sign_change(x, c->of_slope, &point, &ignored)
                        : next_extremum(&c->points, &point))
            high = least(point, c->end);
        if ((c->of_slope && given_up(c->of_slope)) || ++c->examined == MOST_EXTREMA) return 0;
        int has_end = !is_endless(high);
        Big later = has_end ? levelled(x, c, high) : c->last;
        if (later.sign && (later.sign > 0) != c->is_positive) {
            if (!has_end) {
                high = plus(scaled(c->low, 1), over(ONE, x->fast));
                while ((levelled(x, c, high).sign > 0) == c->is_positive) {
                    c->low = high;
                    high = scaled(high, 1);
                }
                c->end = high;
            }
            *when = row_zero(x, c->row, c->low, high, c->is_positive, c->level);
            *falls = c->is_positive;
            c->is_positive = !c->is_positive;
            c->low = high;
            return 1;
        }
        c->low = high;
    }
    return 0;
}

/* The first downward zero of the force, s. */
static Big end_of_contact(Extended *x)
{
    SignChanges of_slope;
    Big end = x->force_level.sign ? ENDLESS : x->window, when = ENDLESS, lowest = ENDLESS, t;
    SignChanges changes = sign_changes(x, x->force, end, x->force_level, &of_slope);
    int falls;
    if (next_sign_change(x, &changes, &when, &falls)) return when;
    const SignChanges *beyond = given_up(&changes);
    if (beyond) {
        x->failure = (Failure){TOO_MANY_EXTREMA, {as_double(beyond->low)}};
        return ENDLESS;
    }
    Big growth = minus(x->rates.a, x->rates.c);
    if (!x->oscillates || growth.sign <= 0 || x->force_level.sign) return ENDLESS;
    /* e^(rt) F oscillates about the real mode's coefficient with a growing amplitude. */
    Extrema points = extrema(x, x->force);
    for (int n = 0; n < 2; n++) {
        next_extremum(&points, &t);
        Big value = times(exponential(times(x->rates.a, t)), row_at(x, t, x->force));
        if (!below(value, lowest)) continue;
        lowest = value;
        when = t;
    }
    Big level = x->force.a, half_period = over(BIG_PI, x->rates.s), period = scaled(half_period, 1);
    double decades = logarithm(over(level, minus(level, lowest)));
    Big periods = over(big(decades), times(growth, period));
    when = plus(when, times(rounded(periods), period));
    while (row_at(x, when, x->force).sign > 0) when = plus(when, period);
    return row_zero(x, x->force, minus(when, half_period), when, 1, ZERO);
}

/* SET-UP */

/* s^3 - trace s^2 + minors s - product, of which -r is a root with the sign turned. */
typedef struct {
    Big trace, minors, product;
} Cubic;

static Derivatives cubic(const void *context, Big r)
{
    const Cubic *c = context;
    Big twice = scaled(c->trace, 1);
    return (Derivatives){
        minus(c->product, times(r, minus(c->minors, times(r, minus(c->trace, r))))),
        minus(times(r, minus(twice, by(r, 3.0))), c->minors), minus(twice, by(r, 6.0))};
}

/* Set the rates: a real one is between these. */
static void find_rates(Extended *x, Cubic c, Big low, Big high)
{
    Big r = below(low, high) ? zero_between(cubic, &c, low, high, 1) : low;
    Big h = scaled(minus(c.trace, r), -1), rest = r.sign ? over(c.product, r) : c.minors;
    Big square = minus(rest, times(h, h)), apart = by(rest, APART);
    if (below(magnitude(square), apart)) square = negative(apart);
    Big second = root(magnitude(square));
    x->oscillates = square.sign > 0;
    x->rates = (BigRow){r, h, second};
    x->fast = x->oscillates ? h : plus(h, second);
    x->slow = x->oscillates ? h : over(rest, x->fast);
    /* Maxima and first zeros lie within three half periods: earlier oscillations are larger. */
    x->window = x->oscillates ? over(by(BIG_PI, 3.0), second) : ENDLESS;
}

/* The matrix of x = (d, w, V): d' = w, w' = -square d - alpha w + beta V, V' = delta w - gamma V. */
typedef struct {
    Big square, alpha, beta, gamma, delta;
} Matrix;

/* (A + rate) x. */
static void shifted(const Matrix *m, Big rate, const Big x[3], Big y[3])
{
    Big w = plus(negative(times(m->square, x[0])), negative(times(m->alpha, x[1])));
    y[0] = plus(x[1], times(rate, x[0]));
    y[1] = plus(plus(w, times(m->beta, x[2])), times(rate, x[1]));
    y[2] = plus(minus(times(m->delta, x[1]), times(m->gamma, x[2])), times(rate, x[2]));
}

/* The rows of d, w and V: Newton's form of the exponential, e^(At) x = E x + S y + G z. */
static void set_rows(Extended *x, const Matrix *m, const Big initial[3])
{
    Big r = x->rates.a, h = x->rates.c, second = x->rates.s, lead = minus(h, r);
    Big y[3], z[3], g = plus(times(lead, lead), with_sign(x, times(second, second)));
    shifted(m, r, initial, y);
    shifted(m, minus(scaled(h, 1), r), y, z);
    g = over(ONE, g);
    BigRow *rows[3] = {&x->d, &x->w, &x->mean};
    for (int n = 0; n < 3; n++) {
        /* Without drag exactly 0: a rounding error in the real mode, which doesn't decay, would
           outlast all else. */
        Big a = n == 2 ? initial[2] : ZERO;
        if (x->drag.sign) a = plus(initial[n], times(z[n], g));
        Big s = over(minus(y[n], times(times(lead, z[n]), g)), second);
        *rows[n] = (BigRow){a, minus(initial[n], a), s};
    }
}

static void extended_begin(Extended *x, double k_, double damper_, double drag_, double m_club_,
                           double m_ball_, Motion start, double club_force_)
{
    Big k = big(k_), damper = big(damper_), drag = big(drag_), force = big(club_force_);
    Big m_club = big(m_club_), m_ball = big(m_ball_), total = plus(m_club, m_ball);
    Big p = over(m_ball, total), q = over(m_club, total), mu = times(m_club, p);
    if (drag.sign) drag = greatest(drag, by(root(times(k, mu)), 2.0 * APART));
    Big slow = over(drag, m_club), fast = over(drag, m_ball), swapped = slow;
    if (below(fast, slow)) {
        slow = fast;
        fast = swapped;
    }
    Big apart = over(times(drag, minus(m_club, m_ball)), total);
    Big gamma = over(scaled(drag, 1), total), square = over(k, mu);
    Big alpha = minus(plus(plus(over(damper, mu), slow), fast), gamma);
    Matrix matrix = {square, alpha, over(apart, mu), gamma, over(apart, total)};
    Big minors = minus(times(alpha, gamma), times(matrix.beta, matrix.delta));
    Cubic c = {plus(alpha, gamma), plus(minors, square), times(square, gamma)};
    /* A real rate is between those of the drags; with a damper as well, it may be any. */
    int is_any = damper.sign && below(slow, fast);
    memset(x, 0, sizeof *x);
    find_rates(x, c, is_any ? ZERO : slow, is_any ? c.trace : fast);
    x->rate = as_double(greatest(c.trace, root(square)));
    x->start = start;
    x->drag = drag;
    x->total = total;
    x->m_ball = m_ball;
    x->q = q;
    x->club_force = force;
    x->d_0 = big(start.compression);
    x->mean_0 = plus(times(q, big(start.v_club)), times(p, big(start.v_ball)));
    /* Under a force the motion is that about a fixed point: with drag one that moves uniformly,
       without it one that accelerates uniformly. */
    x->level = over(times(p, force), k);
    if (drag.sign) {
        x->level = over(force, scaled(k, 1));
        x->drift = over(force, scaled(drag, 1));
    }
    x->force_level = times(k, x->level);
    Big w = big(start.closing);
    set_rows(x, &matrix, (Big[3]){minus(x->d_0, x->level), w, minus(x->mean_0, x->drift)});
    x->force = (BigRow){plus(times(k, x->d.a), times(damper, x->w.a)),
                        plus(times(k, x->d.c), times(damper, x->w.c)),
                        plus(times(k, x->d.s), times(damper, x->w.s))};
    /* Exactly 0 at touch, which the sum of level and coefficients may miss by rounding. */
    x->first_force = plus(times(k, x->d_0), times(damper, w));
    if (x->level.sign && !is_endless(x->window)) x->window = by(x->window, MORE);
    Big end = end_of_contact(x);
    x->duration = is_endless(end) ? INFINITY : as_double(end);
}

/* EVALUATION */

/* Force, compression, closing speed, and of the ball velocity and displacement. */
typedef struct {
    Big force, d, w, v_ball, moved;
} BigMotion;

static BigMotion extended_motion(const Extended *x, Big t)
{
    BigRow b = basis(x, t);
    Big force = plus(row_with(b, x->force), x->force_level), w = row_with(b, x->w);
    Big d = plus(row_with(b, x->d), x->level), mean = plus(row_with(b, x->mean), x->drift);
    Big back = minus(d, x->d_0), moved = minus(times(mean, t), times(x->q, back));
    if (x->drag.sign) {
        /* Drag times the sum of the paths is the momentum that is lost. */
        Big lost = plus(times(x->total, minus(x->mean_0, mean)), times(x->club_force, t));
        moved = scaled(minus(over(lost, x->drag), back), -1);
    } else if (x->club_force.sign) {
        Big gained = times(over(x->club_force, x->total), t);
        mean = plus(mean, gained);
        moved = plus(moved, scaled(times(gained, t), -1));
    }
    return (BigMotion){force, d, w, minus(mean, times(x->q, w)), moved};
}

static State extended_state(const Extended *x, double t)
{
    BigMotion m = extended_motion(x, big(t));
    Big x_ball = plus(minus(big(x->start.x_club), x->d_0), m.moved);
    return (State){as_double(m.force), as_double(plus(x_ball, m.d)), as_double(x_ball),
                   as_double(plus(m.v_ball, m.w)), as_double(m.v_ball), as_double(m.d)};
}

static double extended_value(const Extended *x, Quantity quantity, double t)
{
    return as_double(plus(level_of(x, quantity), row_at(x, big(t), row_of(x, quantity))));
}

static double extended_impulse(const Extended *x, double begin, double width)
{
    BigMotion first = extended_motion(x, big(begin));
    BigMotion last = extended_motion(x, plus(big(begin), big(width)));
    Big gained = times(x->m_ball, minus(last.v_ball, first.v_ball));
    return as_double(plus(gained, times(x->drag, minus(last.moved, first.moved))));
}

/* When a quantity has maxima inside the phase, in order; returns how many, at most `most`. */
static int extended_maxima(const Extended *x, Quantity quantity, double when[], int most)
{
    Big end = x->window, t;
    if (isfinite(x->duration)) end = least(big(x->duration), end);
    SignChanges changes = sign_changes(x, row_slope(x, row_of(x, quantity)), end, ZERO, NULL);
    int falls, count = 0;
    while (count < most && next_sign_change(x, &changes, &t, &falls))
        if (falls) when[count++] = as_double(t);
    return count;
}
