/* Numbers of 352 bits, 105 digits: what numerics/decimals.py has 57 or 95 digits for.

   A cancellation of 70 digits is harmless, so that results rounded to a double are the same. */

enum { LIMBS = 11 };

/* sign * 0.limbs * 2^exponent; the first bit of the limbs is 1, unless the sign is 0. */
typedef struct {
    int sign;
    int64_t exponent;
    uint32_t limbs[LIMBS];
} Big;

static const Big ZERO = {0, 0, {0}};
static const Big ONE = {1, 1, {0x80000000u}};
/* For comparisons only. */
static const Big ENDLESS = {1, INT64_C(1) << 60, {0x80000000u}};
static const Big BIG_PI = {1, 2, {0xc90fdaa2u, 0x2168c234u, 0xc4c6628bu, 0x80dc1cd1u, 0x29024e08u,
                                  0x8a67cc74u, 0x020bbea6u, 0x3b139b22u, 0x514a0879u, 0x8e3404ddu,
                                  0xef9519b3u}};
static const Big LN_2 = {1, 0, {0xb17217f7u, 0xd1cf79abu, 0xc9e3b398u, 0x03f2f6afu, 0x40f34326u,
                                0x7298b62du, 0x8a0d175bu, 0x8baafa2bu, 0xe7b87620u, 0x6debac98u,
                                0x559552fbu}};

/* An argument is halved, an angle taken a third of, so often before its series. */
enum { HALVINGS = 12, THIRDS = 4 };

static Big big(double x)
{
    Big b = ZERO;
    int exponent;
    if (!x) return b;
    uint64_t bits = (uint64_t)ldexp(frexp(fabs(x), &exponent), 64);
    b.sign = x < 0.0 ? -1 : 1;
    b.exponent = exponent;
    b.limbs[0] = (uint32_t)(bits >> 32);
    b.limbs[1] = (uint32_t)bits;
    return b;
}

/* The nearest double. */
static double as_double(Big b)
{
    if (!b.sign || b.exponent < -1080) return 0.0;
    if (b.exponent > 1024) return b.sign * HUGE_VAL;
    uint64_t bits = (uint64_t)b.limbs[0] << 32 | b.limbs[1], beyond = 0;
    for (int n = 2; n < LIMBS; n++) beyond |= b.limbs[n];
    /* Of 64 bits 53 are kept, fewer of a subnormal number. */
    int dropped = 11 + (b.exponent < -1021 ? (int)(-1021 - b.exponent) : 0);
    if (dropped > 63) return 0.0;
    uint64_t kept = bits >> dropped, rest = bits & ((UINT64_C(1) << dropped) - 1);
    uint64_t half = UINT64_C(1) << (dropped - 1);
    if (rest > half || (rest == half && (beyond || (kept & 1)))) kept++;
    return b.sign * ldexp((double)kept, (int)b.exponent - 64 + dropped);
}

static Big negative(Big a)
{
    a.sign = -a.sign;
    return a;
}

static Big magnitude(Big a)
{
    a.sign = a.sign != 0;
    return a;
}

/* a * 2^twos. */
static Big scaled(Big a, int64_t twos)
{
    a.exponent += twos;
    return a;
}

static int compare_magnitudes(const Big *a, const Big *b)
{
    if (!a->sign || !b->sign) return !!a->sign - !!b->sign;
    if (a->exponent != b->exponent) return a->exponent < b->exponent ? -1 : 1;
    for (int n = 0; n < LIMBS; n++)
        if (a->limbs[n] != b->limbs[n]) return a->limbs[n] < b->limbs[n] ? -1 : 1;
    return 0;
}

static int compare(Big a, Big b)
{
    if (a.sign != b.sign) return a.sign < b.sign ? -1 : 1;
    return a.sign < 0 ? compare_magnitudes(&b, &a) : compare_magnitudes(&a, &b);
}

static int below(Big a, Big b) { return compare(a, b) < 0; }
static Big least(Big a, Big b) { return below(b, a) ? b : a; }
static Big greatest(Big a, Big b) { return below(a, b) ? b : a; }
static int is_endless(Big a) { return a.exponent == ENDLESS.exponent; }

/* With a first bit of 1. */
static Big normal(Big a)
{
    int limbs = 0, bits = 0;
    while (limbs < LIMBS && !a.limbs[limbs]) limbs++;
    if (limbs == LIMBS) return ZERO;
    while (!(a.limbs[limbs] << bits & 0x80000000u)) bits++;
    for (int n = 0; n < LIMBS; n++) {
        uint32_t high = n + limbs < LIMBS ? a.limbs[n + limbs] : 0;
        uint32_t next = n + limbs + 1 < LIMBS ? a.limbs[n + limbs + 1] : 0;
        a.limbs[n] = bits ? high << bits | next >> (32 - bits) : high;
    }
    a.exponent -= 32 * limbs + bits;
    return a;
}

static Big plus(Big a, Big b)
{
    if (compare_magnitudes(&a, &b) < 0) {
        Big swapped = a;
        a = b;
        b = swapped;
    }
    if (!b.sign || a.exponent - b.exponent >= 32 * LIMBS) return a;
    int shift = (int)(a.exponent - b.exponent), limbs = shift / 32, bits = shift % 32;
    uint64_t carry = 0;
    Big total = a;
    for (int n = LIMBS - 1; n >= 0; n--) {
        uint64_t limb = n >= limbs ? b.limbs[n - limbs] : 0;
        uint64_t before = n > limbs ? b.limbs[n - limbs - 1] : 0;
        uint32_t moved = (uint32_t)(bits ? limb >> bits | before << (32 - bits) : limb);
        uint64_t sum = a.sign == b.sign ? (uint64_t)a.limbs[n] + moved + carry
                                        : (uint64_t)a.limbs[n] - moved - carry;
        total.limbs[n] = (uint32_t)sum;
        carry = sum >> 32 & 1;
    }
    if (a.sign != b.sign) return normal(total);
    if (carry) {
        for (int n = LIMBS - 1; n > 0; n--)
            total.limbs[n] = total.limbs[n] >> 1 | total.limbs[n - 1] << 31;
        total.limbs[0] = total.limbs[0] >> 1 | 0x80000000u;
        total.exponent++;
    }
    return total;
}

static Big minus(Big a, Big b) { return plus(a, negative(b)); }

static Big times(Big a, Big b)
{
    uint32_t product[2 * LIMBS] = {0};
    Big c = {a.sign * b.sign, a.exponent + b.exponent, {0}};
    if (!c.sign) return ZERO;
    for (int i = LIMBS - 1; i >= 0; i--) {
        uint64_t carry = 0;
        for (int j = LIMBS - 1; j >= 0; j--) {
            carry += (uint64_t)a.limbs[i] * b.limbs[j] + product[i + j + 1];
            product[i + j + 1] = (uint32_t)carry;
            carry >>= 32;
        }
        product[i] = (uint32_t)carry;
    }
    int shift = !(product[0] & 0x80000000u);
    for (int n = 0; n < LIMBS; n++)
        c.limbs[n] = shift ? product[n] << 1 | product[n + 1] >> 31 : product[n];
    c.exponent -= shift;
    return c;
}

static Big by(Big a, double x) { return times(a, big(x)); }

static Big over(Big a, Big b)
{
    /* Newton's method for 1/b, from 53 bits on, with b in 1/2...1 times 2. */
    Big two = scaled(ONE, 1), unit = b;
    unit.sign = 1;
    unit.exponent = 1;
    Big inverse = big(1.0 / as_double(unit));
    for (int n = 0; n < 3; n++) inverse = times(inverse, minus(two, times(unit, inverse)));
    Big quotient = times(a, inverse);
    quotient.exponent += 1 - b.exponent;
    quotient.sign *= b.sign;
    return quotient;
}

/* By a small number. */
static Big divided(Big a, uint32_t n)
{
    uint64_t rest = 0;
    for (int k = 0; k < LIMBS; k++) {
        rest = rest << 32 | a.limbs[k];
        a.limbs[k] = (uint32_t)(rest / n);
        rest %= n;
    }
    return a.sign ? normal(a) : a;
}

/* The square root; 0 of numbers below 0. */
static Big root(Big a)
{
    if (a.sign <= 0) return ZERO;
    int odd = (int)(a.exponent & 1);
    Big unit = a, three = big(3.0);
    unit.exponent = odd;
    /* Newton's method for 1/sqrt. */
    Big inverse = big(1.0 / sqrt(as_double(unit)));
    for (int n = 0; n < 3; n++) {
        Big square = times(inverse, inverse);
        inverse = scaled(times(inverse, minus(three, times(unit, square))), -1);
    }
    Big result = times(unit, inverse);
    result.exponent += (a.exponent - odd) / 2;
    return result;
}

/* The nearest integer. */
static Big rounded(Big a)
{
    Big b = plus(magnitude(a), scaled(ONE, -1));
    if (!a.sign || b.exponent <= 0) return ZERO;
    for (int n = 0; n < LIMBS; n++) {
        int64_t kept = b.exponent - 32 * n;
        if (kept <= 0) b.limbs[n] = 0;
        else if (kept < 32) b.limbs[n] &= ~(0xffffffffu >> kept);
    }
    b.sign = a.sign;
    return b;
}

/* Whether a term is beyond the last bit of a sum. */
static int is_negligible(Big term, int64_t exponent)
{
    return !term.sign || term.exponent <= exponent - 32 * LIMBS;
}

static Big exponential(Big x)
{
    /* e^x is 0 where its exponent would leave 64 bits. */
    if (x.sign < 0 && x.exponent > 58) return ZERO;
    Big twos = rounded(over(x, LN_2));
    Big small = scaled(minus(x, times(twos, LN_2)), -HALVINGS), sum = ONE, term = ONE;
    for (uint32_t n = 1; !is_negligible(term, 0); n++) {
        term = divided(times(term, small), n);
        sum = plus(sum, term);
    }
    for (int n = 0; n < HALVINGS; n++) sum = times(sum, sum);
    uint64_t bits = (uint64_t)twos.limbs[0] << 32 | twos.limbs[1];
    if (twos.sign) sum.exponent += (int64_t)(bits >> (64 - twos.exponent)) * twos.sign;
    return sum;
}

static void cosine_sine(Big angle, Big *cosine, Big *sine)
{
    Big two_pi = scaled(BIG_PI, 1), turns = rounded(over(angle, two_pi)), three = big(3.0);
    Big small = divided(minus(angle, times(turns, two_pi)), 4 * 81);
    Big square = negative(times(small, small)), s = small, term = small;
    for (uint32_t n = 2; !is_negligible(term, small.exponent); n += 2) {
        term = divided(times(term, square), n * (n + 1));
        s = plus(s, term);
    }
    for (int n = 0; n < THIRDS; n++) s = times(s, minus(three, scaled(times(s, s), 2)));
    /* Of a quarter of the angle, so the cosine is above 0.7. */
    Big c = root(minus(ONE, times(s, s)));
    for (int n = 0; n < 2; n++) {
        Big doubled = scaled(times(s, c), 1);
        c = minus(ONE, scaled(times(s, s), 1));
        s = doubled;
    }
    *cosine = c;
    *sine = s;
}

/* Of a number above 0, as a double: for the ends of brackets. */
static double logarithm(Big a)
{
    Big unit = a;
    unit.exponent = 0;
    return log(as_double(unit)) + (double)a.exponent * 0.6931471805599453;
}
