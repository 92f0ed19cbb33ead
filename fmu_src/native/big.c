/* Numbers of 352 bits, 105 digits: those of a sentence are printed without the C library (refusals.c). */

enum { LIMBS = 11 };

/* sign * 0.limbs * 2^exponent; the first bit of the limbs is 1, unless the sign is 0. */
typedef struct {
    int sign;
    int64_t exponent;
    uint32_t limbs[LIMBS];
} Big;

static const Big ZERO = {0, 0, {0}};
static const Big ONE = {1, 1, {0x80000000u}};

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

