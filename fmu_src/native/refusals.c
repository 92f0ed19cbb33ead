/* refusals.py: which values are refused, and the sentences that say why; those of golf_physics. */

/* Why a value, or a call, is refused: the place of the variable in the table (SETTABLE: the start
   time), and the numbers of the sentence. */
typedef struct {
    Reason reason;
    int place;
    Type type;
    double numbers[7];
    /* What a contact that can't be computed prevents: the sentence on that, with the last numbers. */
    Reason prevented;
} Refusal;

static const Refusal ACCEPTED = {FINE, 0, REAL, {0.0}, FINE};

static Refusal refusal(Reason reason, double a, double b)
{
    return (Refusal){reason, 0, REAL, {a, b}, FINE};
}

static Refusal refusal_of(int place, double value)
{
    return (Refusal){OUT_OF_RANGE, place, TABLE[place].type, {value}, FINE};
}

/* The place of a variable in the table; -1: there is none with this value reference. */
static int place_of(uint32_t reference)
{
    return reference < sizeof PLACES ? PLACES[reference] : -1;
}

/* Of what a failure prevents, with two numbers of its sentence. */
static Refusal refusal_of_failure(Failure failure, Reason prevented, double a, double b)
{
    const double *n = failure.numbers;
    return (Refusal){failure.reason, 0, REAL, {n[0], n[1], n[2], 0.0, 0.0, a, b}, prevented};
}

/* VALUES */

/* Why these values, each of them allowed, are rejected together. */
static Refusal conflict(const Parameters *p, Inputs inputs)
{
    if (p->law == ABSOLUTE) {
        if (p->exponent != 1.0) return refusal(EXPONENT_WITH_LAW_1, p->exponent, 0.0);
        if (p->restitution_at_rest)
            return refusal(RESTITUTION_AT_REST_WITH_LAW_1, p->restitution_at_rest, 0.0);
    }
    if (p->m_club > MOST_RATIO * p->m_ball || p->m_ball > MOST_RATIO * p->m_club)
        return refusal(MASS_RATIO, p->m_club, p->m_ball);
    if (p->restitution_at_rest) return ACCEPTED;
    /* Of a power law in its own time, see law_damping. */
    double mu = p->m_club * (p->m_ball / (p->m_club + p->m_ball));
    double critical = 2.0 * sqrt(0.5 * (p->exponent + 1.0) * inputs.k * mu);
    if (inputs.b <= MOST_DAMPING_RATIO * critical) return ACCEPTED;
    return refusal(DAMPING_RATIO, inputs.b, inputs.b / critical);
}

/* Why a force on the club head is rejected at touch: beside it the approach speed must not vanish. */
static Refusal refusal_of_force(const Parameters *p, Inputs inputs, double closing)
{
    double force = inputs.club_force, contact_force;
    if (p->exponent == 1.0)
        return is_large_push(p, inputs, closing, &contact_force)
                   ? refusal(LARGE_PUSH, force, contact_force) : ACCEPTED;
    if (!is_large_push_of_power_law(p, inputs.k, force, 0.0, closing, &contact_force)) return ACCEPTED;
    return refusal(LARGE_PUSH_OF_POWER_LAW, force, contact_force);
}

/* Why a touch under these inputs is rejected: a coefficient of restitution that falls with the speed
   must stay in 0...1. */
static Refusal refusal_of_touch(const Parameters *p, Inputs inputs)
{
    double closing = inputs.club_speed - p->ball_speed;
    double coefficient = p->restitution_at_rest - p->restitution_slope * closing;
    if (closing <= SLOWEST) return ACCEPTED;
    if (!p->restitution_at_rest || (LEAST_RESTITUTION <= coefficient && coefficient <= 1.0))
        return refusal_of_force(p, inputs, closing);
    return (Refusal){TOUCH, 0, REAL,
                     {inputs.club_speed, p->restitution_at_rest, p->restitution_slope, closing,
                      coefficient}, FINE};
}

/* NUMBERS: without the C library, whose decimal point depends on the host's locale */

enum { NUMBER_SIZE = 32 };

/* 10^n. */
static Big power_of_ten(int n)
{
    Big power = ONE, square = big(10.0);
    for (int left = abs(n); left; left /= 2) {
        if (left % 2) power = times(power, square);
        square = times(square, square);
    }
    return n < 0 ? over(ONE, power) : power;
}

static Big big_integer(uint64_t n)
{
    return plus(scaled(big((double)(n >> 32)), 32), big((double)(n & 0xffffffffu)));
}

static uint64_t as_integer(Big b)
{
    uint64_t bits = (uint64_t)b.limbs[0] << 32 | b.limbs[1];
    return b.sign ? bits >> (64 - b.exponent) : 0;
}

/* The digits of a number above 0, and its power of ten: 10^(count-1) <= digits < 10^count. */
static uint64_t digits_of(double x, int count, int *power)
{
    *power = (int)floor(log10(x));
    for (;;) {
        uint64_t least = as_integer(power_of_ten(count - 1));
        uint64_t digits = as_integer(rounded(times(big(x), power_of_ten(count - 1 - *power))));
        if (digits >= 10 * least) ++*power;
        else if (digits < least) --*power;
        else return digits;
    }
}

typedef struct {
    char *end;
    const char *limit;
} Text;

static void put_character(Text *t, char c)
{
    if (t->end < t->limit) *t->end++ = c;
    *t->end = 0;
}

static void put(Text *t, const char *words)
{
    while (*words) put_character(t, *words++);
}

/* The most significant digit first, with a point before one of them (0: the first). */
static void put_digits(Text *t, uint64_t digits, int count, int point)
{
    char reversed[NUMBER_SIZE];
    for (int n = 0; n < count; n++, digits /= 10) reversed[n] = (char)('0' + digits % 10);
    for (int n = 0; n < count; n++) {
        if (n == point) put_character(t, '.');
        put_character(t, reversed[count - 1 - n]);
    }
}

static void put_integer(Text *t, double x)
{
    uint64_t n = (uint64_t)fabs(x);
    int count = 1;
    for (uint64_t rest = n; rest >= 10; rest /= 10) count++;
    if (x < 0.0) put(t, "-");
    put_digits(t, n, count, -1);
}

/* As Python's repr of a float, or by `general` as its format "g". */
static void put_number(Text *t, double x, int general)
{
    if (isnan(x)) {
        put(t, "nan");
        return;
    }
    if (signbit(x)) put(t, "-");
    if (isinf(x) || x == 0.0) {
        put(t, x ? "inf" : general ? "0" : "0.0");
        return;
    }
    /* The fewest digits that read back. */
    int count = general ? 6 : 0, power;
    uint64_t digits = 0;
    x = fabs(x);
    if (general) digits = digits_of(x, count, &power);
    else do digits = digits_of(x, ++count, &power);
        while (as_double(times(big_integer(digits), power_of_ten(power + 1 - count))) != x);
    for (; count > 1 && digits % 10 == 0; count--) digits /= 10;
    if (power < -4 || power >= (general ? 6 : 16)) {
        put_digits(t, digits, count, 1);
        put(t, power < 0 ? "e-" : "e+");
        put_digits(t, (uint64_t)abs(power), abs(power) < 100 ? 2 : 3, -1);
        return;
    }
    if (power < 0) put(t, "0.");
    for (int n = -1; n > power; n--) put(t, "0");
    for (; count <= power; count++) digits *= 10;
    put_digits(t, digits, count, power < 0 ? -1 : power + 1);
    if (count == power + 1 && !general) put(t, ".0");
}

/* SENTENCES */

/* By type. */
static const char *const TYPES[] = {"Real",  "Enumeration", "Boolean", "String", "Float32", "Int8",
                                    "UInt8", "Int16",       "UInt16",  "Int32",  "UInt32",  "UInt64"};

/* A sentence with these words in place of each %s. */
static void put_sentence(Text *t, const char *sentence, const char *const words[])
{
    for (; *sentence; sentence++) {
        if (sentence[0] != '%' || sentence[1] != 's') {
            put_character(t, *sentence);
            continue;
        }
        put(t, *words++);
        sentence++;
    }
}

/* The name of a variable by its value reference, or this. */
static void name_of(Text *t, double reference)
{
    char digits[NUMBER_SIZE];
    Text number = {digits, digits + sizeof digits - 1};
    const char *words[] = {digits};
    int place = place_of((uint32_t)reference);
    if (place >= 0) {
        put(t, TABLE[place].name);
        return;
    }
    put_integer(&number, reference);
    put_sentence(t, SENTENCES[NO_VARIABLE], words);
}

static void put_reason(Text *t, const Refusal *r)
{
    char texts[7][NUMBER_SIZE], name[64] = "";
    const char *words[7] = {NULL}, *sentence = SENTENCES[r->reason];
    for (int n = 0; n < 7; n++) {
        Text number = {texts[n], texts[n] + NUMBER_SIZE - 1};
        int is_general = n == 1 && (r->reason == DAMPING_RATIO || r->reason == LARGE_PUSH
                                      || r->reason == LARGE_PUSH_OF_POWER_LAW);
        if (r->type == ENUMERATION) put_integer(&number, r->numbers[n]);
        else put_number(&number, r->numbers[n], is_general);
        words[n] = texts[n];
    }
    Text of = {name, name + sizeof name - 1};
    switch (r->reason) {
    case OUT_OF_RANGE: sentence = TABLE[r->place].refused; break;
    case FIXED:
        words[2] = words[1];
        words[1] = words[0];
        words[0] = TABLE[r->place].name;
        break;
    case SET_AFTER_END: words[0] = TABLE[r->place].name; break;
    case NOT_SETTABLE:
    case NOT_READABLE:
        name_of(&of, r->numbers[0]);
        words[0] = name;
        words[1] = TYPES[r->type];
        break;
    default: break;
    }
    put_sentence(t, sentence, words);
}

static void put_refusal(Text *t, const Refusal *r)
{
    char texts[3][1024] = {"", "", ""};
    const char *words[3];
    Text text[3];
    if (!r->prevented) {
        put_reason(t, r);
        return;
    }
    for (int n = 0; n < 3; n++) {
        text[n] = (Text){texts[n], texts[n] + sizeof texts[n] - 1};
        words[n] = texts[n];
    }
    /* The numbers, as many as the sentence has, and the reason. */
    int count = r->prevented == CHANGE_REFUSED ? 2 : r->prevented == FORCE_REFUSED ? 1 : 0;
    for (int n = 0; n < count; n++) put_number(&text[n], r->numbers[5 + n], 0);
    put_reason(&text[count], r);
    put_sentence(t, SENTENCES[r->prevented], words);
}
