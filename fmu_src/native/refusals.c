/* Which values are refused together, and the sentences that say why: those of golf_physics/refusals.py. */

/* With what this prevents, and two numbers of its sentence. */
static Refusal preventing(Refusal why, Reason prevented, double a, double b)
{
    why.prevented = prevented;
    why.numbers[5] = a;
    why.numbers[6] = b;
    return why;
}

/* VALUES */

/* Why these values, each of them allowed, are rejected together. */
static Refusal conflict(const Parameters *p, Inputs inputs)
{
    if (p->law == ABSOLUTE) {
        double n = p->exponent, at_rest = p->restitution_at_rest;
        if (n != 1.0) return refusal_of(VR_exponent, EXPONENT_WITH_LAW_1, n, 0.0);
        if (at_rest)
            return refusal_of(VR_restitution_at_rest, RESTITUTION_AT_REST_WITH_LAW_1, at_rest, 0.0);
    }
    if (p->m_club > MOST_RATIO * p->m_ball || p->m_ball > MOST_RATIO * p->m_club)
        return refusal(MASS_RATIO, p->m_club, p->m_ball);
    if (p->restitution_at_rest) return ACCEPTED;
    /* Of a power law in its own time, see law_damping. */
    double mu = p->m_club * (p->m_ball / (p->m_club + p->m_ball));
    double critical = 2.0 * sqrt(0.5 * (p->exponent + 1.0) * inputs.k * mu);
    if (inputs.b <= MOST_DAMPING_RATIO * critical) return ACCEPTED;
    return refusal_of(VR_b, DAMPING_RATIO, inputs.b, inputs.b / critical);
}

/* Why a touch under these inputs is rejected: a coefficient of restitution that falls with the speed
   must stay in 0...1. */
static Refusal refusal_of_touch(const Parameters *p, Inputs inputs)
{
    double closing = inputs.club_speed - p->ball_speed;
    double coefficient = p->restitution_at_rest - p->restitution_slope * closing;
    if (!p->restitution_at_rest || (LEAST_RESTITUTION <= coefficient && coefficient <= 1.0))
        return refusal_of_push(p, inputs, closing);
    return (Refusal){TOUCH, place_of(VR_club_speed),
                     {inputs.club_speed, p->restitution_at_rest, p->restitution_slope, closing,
                      coefficient}, FINE};
}

/* SENTENCES */

/* By type. */
static const char *const TYPES[] = {"Real",  "Enumeration", "Boolean", "String", "Float32", "Int8",
                                    "UInt8", "Int16",       "UInt16",  "Int32",  "UInt32",  "UInt64"};

/* The name of a variable by its value reference. */
static void put_name(Text *t, double reference)
{
    int place = place_of((uint32_t)reference);
    if (place < 0) put(t, "value reference ");
    if (place < 0) put_number(t, reference, DIGITS);
    else put(t, TABLE[place].name);
}

/* A sentence of variables.h with names, words and numbers in place of its codes. */
static void put_sentence(Text *t, const char *sentence, const Refusal *r, const double numbers[],
                         const char *words)
{
    for (; *sentence; sentence++) {
        if (*sentence != '%') {
            put_character(t, *sentence);
            continue;
        }
        switch (*++sentence) {
        case 'n':
            if (r->place == SETTABLE) put_name(t, *numbers++);
            else put(t, TABLE[r->place].name);
            break;
        case 't': put(t, TYPES[(int)*numbers++]); break;
        case 's': put(t, words); break;
        default: put_number(t, *numbers++, *sentence == 'g' ? 6 : DIGITS); break;
        }
    }
}

static void put_refusal(Text *t, const Refusal *r)
{
    char text[1024] = "";
    Text why = {text, text + sizeof text - 1};
    const char *sentence = r->reason == OUT_OF_RANGE ? TABLE[r->place].refused : SENTENCES[r->reason];
    put_sentence(r->prevented ? &why : t, sentence, r, r->numbers, "");
    if (r->prevented) put_sentence(t, SENTENCES[r->prevented], r, r->numbers + 5, text);
}
