/* Makes the FMI 2.0 calls that stdin names, one a line, and prints the status and values of each.

   usage: replay FOLDER GUID < calls        (the lines: tests/contract/call_order.py)

   After a crash the results so far are on stdout: the next line of the input caused it. */

#include "fmu.h"

/* A function of the FMU. */
#define FMU(name) CALL(library, name)

enum { SLOTS = 16, WORDS = 64, LINE = 1 << 18 };

/* A slot is known by its name, and kept for good. */
typedef struct {
    char name[16];
    fmi2Component instance;
    fmi2FMUstate state;
    char *bytes;
    size_t size;
} Slot;

static Slot slots[SLOTS];
static void *library;
static const char *folder, *guid;

static Slot *slot(const char *name)
{
    for (int n = 0; n < SLOTS; n++) {
        if (!slots[n].name[0]) strncpy(slots[n].name, name, sizeof slots[n].name - 1);
        if (!strcmp(slots[n].name, name)) return &slots[n];
    }
    fail("too many slots");
    return NULL;
}

static void fill(Slot *s, const char *hex)
{
    s->size = strlen(hex) / 2;
    free(s->bytes);
    s->bytes = malloc(s->size + 1);
    for (size_t n = 0; n < s->size; n++) {
        unsigned value;
        sscanf(hex + 2 * n, "%2x", &value);
        s->bytes[n] = (char)value;
    }
}

static fmi2Status pack(fmi2Component c, fmi2FMUstate state, Slot *b)
{
    fmi2Status status = FMU(fmi2SerializedFMUstateSize)(c, state, &b->size);
    if (status > fmi2Warning) return status;
    free(b->bytes);
    b->bytes = malloc(b->size + 1);
    return FMU(fmi2SerializeFMUstate)(c, state, b->bytes, b->size);
}

static fmi2Status set(fmi2Component c, const char *type, char **words, size_t n)
{
    fmi2ValueReference references[WORDS];
    fmi2Real reals[WORDS];
    fmi2Integer integers[WORDS];
    fmi2String strings[WORDS];
    for (size_t i = 0; i < n; i++) {
        char *value = strchr(words[i], '=') + 1;
        references[i] = (fmi2ValueReference)strtoul(words[i], NULL, 10);
        reals[i] = strtod(value, NULL);
        integers[i] = (fmi2Integer)strtol(value, NULL, 10);
        strings[i] = value;
    }
    if (!strcmp(type, "real")) return FMU(fmi2SetReal)(c, references, n, reals);
    if (!strcmp(type, "integer")) return FMU(fmi2SetInteger)(c, references, n, integers);
    if (!strcmp(type, "boolean")) return FMU(fmi2SetBoolean)(c, references, n, integers);
    return FMU(fmi2SetString)(c, references, n, strings);
}

/* Prints the result itself. */
static void get(fmi2Component c, const char *type, char **words, size_t n)
{
    fmi2ValueReference references[WORDS];
    fmi2Real reals[WORDS];
    fmi2Integer integers[WORDS];
    fmi2String strings[WORDS];
    int real = !strcmp(type, "real"), string = !strcmp(type, "string");
    fmi2Status status;
    for (size_t i = 0; i < n; i++)
        references[i] = (fmi2ValueReference)strtoul(words[i], NULL, 10);
    if (real) status = FMU(fmi2GetReal)(c, references, n, reals);
    else if (string) status = FMU(fmi2GetString)(c, references, n, strings);
    else if (!strcmp(type, "integer")) status = FMU(fmi2GetInteger)(c, references, n, integers);
    else status = FMU(fmi2GetBoolean)(c, references, n, integers);
    printf("%d", status);
    for (size_t i = 0; i < n && status <= fmi2Warning; i++) {
        if (real) printf(" %a", reals[i]);
        else if (string) printf(" %s", strings[i]);
        else printf(" %d", integers[i]);
    }
    putchar('\n');
}

static fmi2Status extra(fmi2Component c, const char *name)
{
    fmi2ValueReference reference = 0;
    fmi2Integer integer = 1;
    fmi2Status status;
    fmi2Real real = 1.0;
    fmi2String string;
    if (!strcmp(name, "CancelStep")) return FMU(fmi2CancelStep)(c);
    if (!strcmp(name, "GetStatus")) return FMU(fmi2GetStatus)(c, fmi2DoStepStatus, &status);
    if (!strcmp(name, "GetIntegerStatus"))
        return FMU(fmi2GetIntegerStatus)(c, fmi2DoStepStatus, &integer);
    if (!strcmp(name, "GetBooleanStatus"))
        return FMU(fmi2GetBooleanStatus)(c, fmi2Terminated, &integer);
    if (!strcmp(name, "GetStringStatus"))
        return FMU(fmi2GetStringStatus)(c, fmi2PendingStatus, &string);
    if (!strcmp(name, "SetRealInputDerivatives"))
        return FMU(fmi2SetRealInputDerivatives)(c, &reference, 1, &integer, &real);
    if (!strcmp(name, "GetRealOutputDerivatives"))
        return FMU(fmi2GetRealOutputDerivatives)(c, &reference, 1, &integer, &real);
    return FMU(fmi2GetDirectionalDerivative)(c, &reference, 1, &reference, 1, &real, &real);
}

static fmi2Status log_on(fmi2Component c, int on)
{
    static const fmi2String categories[] = {"logAll", "", "no such category"};
    return FMU(fmi2SetDebugLogging)(c, on, 3, categories);
}

static void play(char **words, size_t n)
{
    const char *call = words[0];
    Slot *s = slot(words[1]), *second = NULL;
    fmi2Component c = s->instance;
    fmi2Status status = fmi2OK;
    if (!strcmp(call, "get")) {
        get(c, words[2], words + 3, n - 3);
        return;
    }
    if (!strcmp(call, "show")) {
        printf("0 ");
        for (size_t i = 0; i < s->size; i++) printf("%02x", (unsigned char)s->bytes[i]);
        putchar('\n');
        return;
    }
    if (strstr("save restore drop pack unpack", call)) second = slot(words[2]);
    if (!strcmp(call, "new")) s->instance = instantiate(library, folder, guid, s->name);
    else if (!strcmp(call, "free")) FMU(fmi2FreeInstance)(c);
    else if (!strcmp(call, "setup"))
        status = FMU(fmi2SetupExperiment)(c, fmi2False, 0.0, strtod(words[2], NULL), fmi2False, 0.0);
    else if (!strcmp(call, "enter")) status = FMU(fmi2EnterInitializationMode)(c);
    else if (!strcmp(call, "exit")) status = FMU(fmi2ExitInitializationMode)(c);
    else if (!strcmp(call, "end")) status = FMU(fmi2Terminate)(c);
    else if (!strcmp(call, "reset")) status = FMU(fmi2Reset)(c);
    else if (!strcmp(call, "set")) status = set(c, words[2], words + 3, n - 3);
    else if (!strcmp(call, "step"))
        status = FMU(fmi2DoStep)(c, strtod(words[2], NULL), strtod(words[3], NULL), fmi2True);
    else if (!strcmp(call, "save")) status = FMU(fmi2GetFMUstate)(c, &second->state);
    else if (!strcmp(call, "restore")) status = FMU(fmi2SetFMUstate)(c, second->state);
    else if (!strcmp(call, "drop")) status = FMU(fmi2FreeFMUstate)(c, &second->state);
    else if (!strcmp(call, "pack")) status = pack(c, second->state, slot(words[3]));
    else if (!strcmp(call, "unpack")) {
        Slot *to = slot(words[3]);
        status = FMU(fmi2DeSerializeFMUstate)(c, second->bytes, second->size, &to->state);
    } else if (!strcmp(call, "fill")) fill(s, n > 2 ? words[2] : "");
    else if (!strcmp(call, "extra")) status = extra(c, words[2]);
    else if (!strcmp(call, "log")) status = log_on(c, atoi(words[2]));
    else fail(call);
    printf("%d\n", status);
}

int main(int argc, char **argv)
{
    static char line[LINE];
    if (argc != 3) fail("usage: replay FOLDER GUID < calls");
    folder = argv[1], guid = argv[2];
    library = load(folder, "ClubBallImpact");
    /* Messages are formatted to their end, as in a host that shows them, but not shown. */
    messages = fopen("/dev/null", "w");
    setvbuf(stdout, NULL, _IOLBF, 0);
    while (fgets(line, sizeof line, stdin)) {
        char *words[WORDS], *rest = line;
        size_t n = 0;
        for (char *word; (word = strsep(&rest, " \n")) && n < WORDS;)
            if (*word) words[n++] = word;
        if (n) play(words, n);
    }
    puts("done");
    return 0;
}
