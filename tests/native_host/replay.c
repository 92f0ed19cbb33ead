/* Makes the FMI 2.0 calls that stdin names, one a line, and answers each with its status and values.

   usage: replay FOLDER GUID < calls        (the language: tests/fmi2_calls.py)

   A crash leaves the answers so far on stdout: the next line of the input did it. */

#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"

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
static char resources[4096];
static const char *guid;

static void fail(const char *what)
{
    fprintf(stderr, "failed: %s\n", what);
    exit(1);
}

static void *symbol(const char *name)
{
    void *found = dlsym(library, name);
    if (!found) fail(name);
    return found;
}

#define CALL(name) ((name##TYPE *)symbol(#name))

/* Reads the message to its end, as a host that shows it does, but shows nothing. */
static void logger(fmi2ComponentEnvironment environment, fmi2String instance, fmi2Status status,
                   fmi2String category, fmi2String message, ...)
{
    char text[4096];
    va_list arguments;
    (void)environment, (void)instance, (void)status, (void)category;
    va_start(arguments, message);
    vsnprintf(text, sizeof text, message, arguments);
    va_end(arguments);
}

static const fmi2CallbackFunctions callbacks = {logger, calloc, free, NULL, NULL};

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
    fmi2Status status = CALL(fmi2SerializedFMUstateSize)(c, state, &b->size);
    if (status > fmi2Warning) return status;
    free(b->bytes);
    b->bytes = malloc(b->size + 1);
    return CALL(fmi2SerializeFMUstate)(c, state, b->bytes, b->size);
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
    if (!strcmp(type, "real")) return CALL(fmi2SetReal)(c, references, n, reals);
    if (!strcmp(type, "integer")) return CALL(fmi2SetInteger)(c, references, n, integers);
    if (!strcmp(type, "boolean")) return CALL(fmi2SetBoolean)(c, references, n, integers);
    return CALL(fmi2SetString)(c, references, n, strings);
}

/* Prints the answer itself. */
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
    if (real) status = CALL(fmi2GetReal)(c, references, n, reals);
    else if (string) status = CALL(fmi2GetString)(c, references, n, strings);
    else if (!strcmp(type, "integer")) status = CALL(fmi2GetInteger)(c, references, n, integers);
    else status = CALL(fmi2GetBoolean)(c, references, n, integers);
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
    if (!strcmp(name, "CancelStep")) return CALL(fmi2CancelStep)(c);
    if (!strcmp(name, "GetStatus")) return CALL(fmi2GetStatus)(c, fmi2DoStepStatus, &status);
    if (!strcmp(name, "GetIntegerStatus"))
        return CALL(fmi2GetIntegerStatus)(c, fmi2DoStepStatus, &integer);
    if (!strcmp(name, "GetBooleanStatus"))
        return CALL(fmi2GetBooleanStatus)(c, fmi2Terminated, &integer);
    if (!strcmp(name, "GetStringStatus"))
        return CALL(fmi2GetStringStatus)(c, fmi2PendingStatus, &string);
    if (!strcmp(name, "SetRealInputDerivatives"))
        return CALL(fmi2SetRealInputDerivatives)(c, &reference, 1, &integer, &real);
    if (!strcmp(name, "GetRealOutputDerivatives"))
        return CALL(fmi2GetRealOutputDerivatives)(c, &reference, 1, &integer, &real);
    return CALL(fmi2GetDirectionalDerivative)(c, &reference, 1, &reference, 1, &real, &real);
}

static fmi2Status log_on(fmi2Component c, int on)
{
    static const fmi2String categories[] = {"logAll", "", "no such category"};
    return CALL(fmi2SetDebugLogging)(c, on, 3, categories);
}

static void make(Slot *s)
{
    s->instance = CALL(fmi2Instantiate)(s->name, fmi2CoSimulation, guid, resources, &callbacks,
                                        fmi2False, fmi2True);
    if (!s->instance) fail("instantiate");
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
    if (!strcmp(call, "new")) make(s);
    else if (!strcmp(call, "free")) CALL(fmi2FreeInstance)(c);
    else if (!strcmp(call, "setup"))
        status = CALL(fmi2SetupExperiment)(c, fmi2False, 0.0, strtod(words[2], NULL), fmi2False, 0.0);
    else if (!strcmp(call, "enter")) status = CALL(fmi2EnterInitializationMode)(c);
    else if (!strcmp(call, "exit")) status = CALL(fmi2ExitInitializationMode)(c);
    else if (!strcmp(call, "end")) status = CALL(fmi2Terminate)(c);
    else if (!strcmp(call, "reset")) status = CALL(fmi2Reset)(c);
    else if (!strcmp(call, "set")) status = set(c, words[2], words + 3, n - 3);
    else if (!strcmp(call, "step"))
        status = CALL(fmi2DoStep)(c, strtod(words[2], NULL), strtod(words[3], NULL), fmi2True);
    else if (!strcmp(call, "save")) status = CALL(fmi2GetFMUstate)(c, &second->state);
    else if (!strcmp(call, "restore")) status = CALL(fmi2SetFMUstate)(c, second->state);
    else if (!strcmp(call, "drop")) status = CALL(fmi2FreeFMUstate)(c, &second->state);
    else if (!strcmp(call, "pack")) status = pack(c, second->state, slot(words[3]));
    else if (!strcmp(call, "unpack")) {
        Slot *to = slot(words[3]);
        status = CALL(fmi2DeSerializeFMUstate)(c, second->bytes, second->size, &to->state);
    } else if (!strcmp(call, "fill")) fill(s, n > 2 ? words[2] : "");
    else if (!strcmp(call, "extra")) status = extra(c, words[2]);
    else if (!strcmp(call, "log")) status = log_on(c, atoi(words[2]));
    else fail(call);
    printf("%d\n", status);
}

int main(int argc, char **argv)
{
    static char file[4096], line[LINE];
    if (argc != 3) fail("usage: replay FOLDER GUID < calls");
    snprintf(file, sizeof file, "%s/binaries/linux64/ClubBallImpact.so", argv[1]);
    snprintf(resources, sizeof resources, "file://%s/resources", argv[1]);
    guid = argv[2];
    library = dlopen(file, RTLD_NOW | RTLD_LOCAL);
    if (!library) fail(dlerror());
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
