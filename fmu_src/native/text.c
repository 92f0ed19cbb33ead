/* Text without the C library's input and output: WebAssembly lacks it, and its decimal point depends on
   the host's locale. */

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

/* NUMBERS: their digits are those of a whole number, which is exact */

enum { LIMBS = 86, DIGITS = 9 * LIMBS, MOST_DIGITS = 17 };

/* m * 2^e, in units of 10^e if e < 0 (then it is m * 5^-e); the most significant digit first. */
static void write_digits(char digits[DIGITS], uint64_t m, int e)
{
    const uint32_t limb = 1000000000;
    uint32_t limbs[LIMBS] = {(uint32_t)(m % limb), (uint32_t)(m / limb)};
    for (int left = abs(e); left; left--) {
        uint64_t carry = 0;
        for (int n = 0; n < LIMBS; n++, carry /= limb) {
            carry += (uint64_t)limbs[n] * (e < 0 ? 5 : 2);
            limbs[n] = (uint32_t)(carry % limb);
        }
    }
    for (int n = 0; n < DIGITS; n++, limbs[(n - 1) / 9] /= 10)
        digits[DIGITS - 1 - n] = (char)('0' + limbs[n / 9] % 10);
}

/* Make the digits from a place on 0: rounded to the nearest, ties to an even digit. */
static void round_digits(char digits[DIGITS], int place)
{
    if (place >= DIGITS) return;
    int is_tie = digits[place] == '5', is_up = digits[place] > '5';
    for (int n = place + 1; is_tie && n < DIGITS; n++) is_up |= digits[n] != '0';
    is_up |= is_tie && digits[place - 1] % 2;
    memset(digits + place, '0', (size_t)(DIGITS - place));
    if (!is_up) return;
    while (digits[--place] == '9') digits[place] = '0';
    digits[place]++;
}

/* As "%.*g" prints it, with so many digits; with 17 if it doesn't read back equal from 15. */
static void put_number(Text *t, double x, int count)
{
    char digits[DIGITS], low[DIGITS], high[DIGITS];
    uint64_t bits, least = UINT64_C(1) << 52;
    memcpy(&bits, &x, sizeof bits);
    int biased = (int)(bits >> 52 & 2047), e = (biased ? biased : 1) - 1075, first = 0;
    uint64_t m = (bits & (least - 1)) | (biased ? least : 0);
    if (bits >> 63 && !isnan(x)) put(t, "-");
    if (biased == 2047 || !m) {
        put(t, !m ? "0" : m == least ? "inf" : "nan");
        return;
    }
    /* In quarters of the last bit: what is read between the middles to both neighbours is x. */
    e -= 2;
    write_digits(low, 4 * m - (m == least ? 1 : 2), e);
    write_digits(high, 4 * m + 2, e);
    for (;; count = MOST_DIGITS) {
        write_digits(digits, 4 * m, e);
        for (first = 0; digits[first] == '0';) first++;
        round_digits(digits, first + count);
        int above = memcmp(digits, low, DIGITS), below = memcmp(high, digits, DIGITS);
        if (count != 15 || (m % 2 ? above > 0 && below > 0 : above >= 0 && below >= 0)) break;
    }
    if (digits[first - 1] != '0') first--;
    int power = DIGITS - 1 - first + (e < 0 ? e : 0), is_scientific = power < -4 || power >= count;
    int leading = is_scientific ? 0 : power;
    while (digits[first + count - 1] == '0') count--;
    int last = leading - count + 1;
    for (int place = leading > 0 ? leading : 0; place >= (last < 0 ? last : 0); place--) {
        if (place == -1) put_character(t, '.');
        put_character(t, place > leading ? '0' : digits[first + leading - place]);
    }
    if (!is_scientific) return;
    put(t, power < 0 ? "e-" : "e+");
    power = abs(power);
    if (power >= 100) put_character(t, (char)('0' + power / 100));
    put_character(t, (char)('0' + power / 10 % 10));
    put_character(t, (char)('0' + power % 10));
}
