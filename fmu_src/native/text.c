/* Text without the C library's input and output: WebAssembly lacks it, and its decimal point depends on
   the host's locale. */

enum { DIGITS = 12 }; /* of a number in a sentence, at most */

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

/* As "%.*g" prints it, with at most so many digits. */
static void put_number(Text *t, double x, int count)
{
    char digits[DIGITS];
    if (signbit(x) && !isnan(x)) put_character(t, '-');
    x = fabs(x);
    if (!x || !isfinite(x)) {
        put(t, !x ? "0" : isnan(x) ? "nan" : "inf");
        return;
    }
    /* So many digits in a whole number; in two steps, since one might overflow. */
    int power = (int)floor(log10(x)), shift = count - 1 - power;
    double whole = nearbyint(x * pow(10.0, shift / 2) * pow(10.0, shift - shift / 2));
    if (whole == pow(10.0, count)) power++;
    for (int n = count - 1; n >= 0; n--, whole = floor(whole / 10.0))
        digits[n] = (char)('0' + (int)fmod(whole, 10.0));
    if (digits[0] == '0') digits[0] = '1'; /* rounded up to another digit */
    int is_scientific = power < -4 || power >= count, leading = is_scientific ? 0 : power;
    while (digits[count - 1] == '0') count--;
    int last = leading - count + 1;
    for (int place = leading > 0 ? leading : 0; place >= (last < 0 ? last : 0); place--) {
        if (place == -1) put_character(t, '.');
        put_character(t, place > leading || place < last ? '0' : digits[leading - place]);
    }
    if (!is_scientific) return;
    put(t, power < 0 ? "e-" : "e+");
    power = abs(power);
    if (power >= 100) put_character(t, (char)('0' + power / 100));
    put_character(t, (char)('0' + power / 10 % 10));
    put_character(t, (char)('0' + power % 10));
}
