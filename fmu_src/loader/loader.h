/* What the functions of FMI 2.0 and 3.0 share: a Python to run in, and calls of the slave.

   Nothing of Python is linked here. Its functions are looked up at run time: in the host if that is
   a Python itself, else in the private one included in the FMU. All of them belong to the stable
   ABI, so this binary works with every Python from 3.10 on.

   The build defines MODULE and CLASS of the slave, PRIVATE_PYTHON, PYTHON_DLL on Windows, TOKEN (the
   GUID) and the file of frozen modules. */

#include "platform.h"

typedef struct object Object;

#define PYTHON(X)                                                                                  \
    X(int, PyGILState_Ensure, (void))                                                              \
    X(void, PyGILState_Release, (int))                                                             \
    X(void, Py_IncRef, (Object *))                                                                 \
    X(void, Py_DecRef, (Object *))                                                                 \
    X(Object *, PyImport_ImportModule, (const char *))                                             \
    X(Object *, PyObject_GetAttrString, (Object *, const char *))                                  \
    X(Object *, PyObject_CallFunctionObjArgs, (Object *, ...))                                     \
    X(Object *, PyObject_CallMethod, (Object *, const char *, const char *, ...))                  \
    X(Object *, PyObject_Call, (Object *, Object *, Object *))                                     \
    X(Object *, PyObject_Str, (Object *))                                                          \
    X(int, PyObject_IsTrue, (Object *))                                                            \
    X(Object *, Py_BuildValue, (const char *, ...))                                                \
    X(int, PyArg_ParseTuple, (Object *, const char *, ...))                                        \
    X(int, PySequence_Contains, (Object *, Object *))                                              \
    X(Object *, PyTuple_New, (intptr_t))                                                           \
    X(Object *, PyList_New, (intptr_t))                                                            \
    X(int, PyList_SetItem, (Object *, intptr_t, Object *))                                         \
    X(int, PyList_Insert, (Object *, intptr_t, Object *))                                          \
    X(int, PyList_SetSlice, (Object *, intptr_t, intptr_t, Object *))                              \
    X(Object *, PyList_GetItem, (Object *, intptr_t))                                              \
    X(intptr_t, PyList_Size, (Object *))                                                           \
    X(Object *, PyFloat_FromDouble, (double))                                                      \
    X(double, PyFloat_AsDouble, (Object *))                                                        \
    X(Object *, PyLong_FromLongLong, (long long))                                                  \
    X(long long, PyLong_AsLongLong, (Object *))                                                    \
    X(Object *, PyBool_FromLong, (long))                                                           \
    X(Object *, PyUnicode_DecodeFSDefault, (const char *))                                         \
    X(Object *, PyUnicode_FromString, (const char *))                                              \
    X(const char *, PyUnicode_AsUTF8AndSize, (Object *, intptr_t *))                               \
    X(Object *, PyBytes_FromStringAndSize, (const char *, intptr_t))                               \
    X(char *, PyBytes_AsString, (Object *))                                                        \
    X(intptr_t, PyBytes_Size, (Object *))                                                          \
    X(Object *, PyErr_Occurred, (void))                                                            \
    X(void, PyErr_SetInterrupt, (void))                                                            \
    X(void, PyErr_Fetch, (Object **, Object **, Object **))

#define X(result, name, arguments) static result(*name) arguments;
PYTHON(X)
#undef X

EMBED(modules, "modules.bin")

typedef struct {
    Object *slave;
    Object *messages;  /* the slave's list of messages that the host hasn't got yet */
    Object *strings;   /* what the host was given last */
    char *name;        /* of the instance */
    void *environment; /* of the host */
    void *logger;
    int logging;
    size_t category_count;
    char **categories;
    int early_return;  /* what FMI 3.0 lets the host choose */
    int event_mode;
    int refused;       /* the last step */
    double reached;    /* the communication point that it reached, s */
} Instance;

static Lock loading = UNLOCKED;
static Object *slave_class;
static void (*hold)(void); /* NULL in a host's Python, which keeps its own states */
static char resources[4096];
static char failure[1024];
static const char token[] = TOKEN;

/* Of the statuses of FMI 2.0 and 3.0, which have the same numbers. */
enum { FMI_ERROR = 3, FMI_FATAL = 4 };

static void log_message(Instance *i, int status, const char *category, const char *text);

#ifdef _WIN32

/* Never the host's Python: which of its DLLs that is, and whether it stays, isn't visible. */
static int of_host(int *visible) { return *visible = 0; }

/* The library of the private Python, which lies beside this one. Another FMU may have loaded one
   of the same name, and so the same content; they decide one after the other. Its own folder is
   searched for what it needs, not the host's. */
static void *private_python(int visible)
{
    char text[64];
    wchar_t path[4096], name[] = L"" PRIVATE_PYTHON;
    HMODULE own, library = NULL;
    (void)visible;
    snprintf(text, sizeof text, "golf-python of process %lu", GetCurrentProcessId());
    HANDLE turn = CreateMutexA(NULL, FALSE, text);
    WaitForSingleObject(turn, INFINITE);
    if (!GetModuleHandleExW(GET_MODULE_HANDLE_EX_FLAG_PIN, name, &library) &&
        GetModuleHandleExW(OF_ADDRESS, (wchar_t *)private_python, &own)) {
        DWORD length = GetModuleFileNameW(own, path, 4096 - sizeof name / sizeof *name);
        while (length && path[length - 1] != '\\' && path[length - 1] != '/') length--;
        wcscpy(path + length, name);
        library = LoadLibraryExW(path, NULL, LOAD_WITH_ALTERED_SEARCH_PATH);
        if (!library)
            snprintf(failure, sizeof failure, "%s can't be loaded: Windows error %lu",
                     PRIVATE_PYTHON, GetLastError());
        GetModuleHandleExW(GET_MODULE_HANDLE_EX_FLAG_PIN, name, &library);
    }
    ReleaseMutex(turn);
    CloseHandle(turn);
    return library;
}

/* Of the private Python's own library, or of Python's DLL, which has another name here. */
static void *dlsym(void *library, const char *name)
{
    FARPROC found = GetProcAddress(library, name);
    if (!found) found = GetProcAddress(GetModuleHandleA(PYTHON_DLL), name);
    return (void *)(intptr_t)found;
}
#define RTLD_DEFAULT NULL

#else

/* The host's Python, if it can be used: it runs, and is neither too old nor without a GIL. */
static int of_host(int *visible)
{
    int (*running)(void) = (int (*)(void))dlsym(RTLD_DEFAULT, "Py_IsInitialized");
    const char *(*version)(void) = (const char *(*)(void))dlsym(RTLD_DEFAULT, "Py_GetVersion");
    *visible = running && version;
    if (!*visible || !running()) return 0;
    int major = 0, minor = 0;
    sscanf(version(), "%d.%d", &major, &minor);
    return major == 3 && minor >= 10 && !strstr(version(), "free-threading");
}

/* The library of the private Python, by its soname: that finds one which another FMU has
   loaded, or this FMU's by its own RUNPATH, and decides under the linker's own lock, so that FMUs
   started in several threads get one. Bound now: later, names would be looked up in a Python that
   the host has started meanwhile. In a host that shows symbols of Python, the private one's own
   come first. */
static void *private_python(int visible)
{
    int mode = RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE | (visible ? RTLD_DEEPBIND : 0);
    void *library = dlopen(PRIVATE_PYTHON, mode);
    if (!library) snprintf(failure, sizeof failure, "%s", dlerror());
    return library;
}

#endif

static int look_up(void *library)
{
    const char *missing = NULL;
#define X(result, name, arguments)                                                                 \
    *(void **)&name = dlsym(library, #name);                                                       \
    if (!name) missing = #name;
    PYTHON(X)
#undef X
    if (missing) snprintf(failure, sizeof failure, "this Python has no %s", missing);
    return !missing;
}

/* The folder resources: from where this library lies. The host's URI may be escaped in many ways. */
static int find_resources(void)
{
    if (!find_library((void *)find_resources, resources, sizeof resources)) return 0;
    for (int n = 0; n < 3; n++) {
        char *slash = strrchr(resources, '/');
        if (slash) *slash = 0;
        else strcpy(resources, n < 2 ? ".." : "."); /* loaded by a relative name */
    }
    strncat(resources, "/resources", sizeof resources - strlen(resources) - 1);
    return 1;
}

/* Puts the text of the exception into `failure` and clears it. The status that a call has then:
   FMI_ERROR if Ctrl-C has interrupted it. */
static int fetch(void)
{
    Object *type = NULL, *value = NULL, *trace = NULL;
    PyErr_Fetch(&type, &value, &trace);
    Object *text = value ? PyObject_Str(value) : NULL;
    Object *kind = type ? PyObject_GetAttrString(type, "__name__") : NULL;
    const char *words = text ? PyUnicode_AsUTF8AndSize(text, NULL) : NULL;
    const char *name = kind ? PyUnicode_AsUTF8AndSize(kind, NULL) : NULL;
    int interrupted = name && !strcmp(name, "KeyboardInterrupt");
    if (name && !strcmp(name, "MemoryError")) strcpy(failure, "out of memory");
    else
        snprintf(failure, sizeof failure, "exception in Python: %s: %s", name ? name : "unknown",
                 words ? words : "");
    Object *all[] = {type, value, trace, text, kind};
    for (int n = 0; n < 5; n++) Py_DecRef(all[n]);
    return interrupted ? FMI_ERROR : FMI_FATAL;
}

/* In a host's Python the modules are the files in the FMU. */
static int add_path(void)
{
    Object *module = PyImport_ImportModule("sys");
    Object *path = module ? PyObject_GetAttrString(module, "path") : NULL;
    Object *folder = path ? PyUnicode_DecodeFSDefault(resources) : NULL;
    int fine = folder != NULL;
    if (fine && !PySequence_Contains(path, folder)) fine = PyList_Insert(path, 0, folder) == 0;
    Py_DecRef(folder);
    Py_DecRef(path);
    Py_DecRef(module);
    return fine;
}

/* Finds or starts a Python and imports the slave's class, once; 0 if that fails. */
static int ready(void)
{
    lock(&loading);
    if (!slave_class) {
        int visible, (*start)(const unsigned char *, const unsigned char *) = NULL;
        void *library = RTLD_DEFAULT;
        int reused = of_host(&visible);
        int fine = find_resources();
        if (fine && !reused) {
            library = private_python(visible);
            fine = library != NULL;
        }
        fine = fine && look_up(library);
        if (fine && !reused) {
            *(void **)&start = dlsym(library, "private_python_start");
            *(void **)&hold = dlsym(library, "private_python_hold");
            fine = start(modules, modules_end);
            if (!fine) strcpy(failure, "the private Python doesn't start");
        }
        if (fine) {
            int outer = PyGILState_Ensure();
            Object *module = !reused || add_path() ? PyImport_ImportModule(MODULE) : NULL;
            slave_class = module ? PyObject_GetAttrString(module, CLASS) : NULL;
            Py_DecRef(module);
            if (!slave_class) fetch();
            PyGILState_Release(outer);
        }
    }
    unlock(&loading);
    return slave_class != NULL;
}

/* What a call into Python ends with. */
typedef struct {
    unsigned floating;
    int outer;
} Entry;

static Entry enter(void)
{
    Entry entry = {default_floating(), 0};
    if (hold) hold();
    entry.outer = PyGILState_Ensure();
    return entry;
}

static void leave(Entry entry)
{
    PyGILState_Release(entry.outer);
    restore_floating(entry.floating);
}

/* Forwards messages to the host; an exception, too. Returns 0 if there was none, or the status. */
static int flush(Instance *i)
{
    int status = PyErr_Occurred() ? fetch() : 0;
    if (status == FMI_FATAL) log_message(i, status, "logStatusFatal", failure);
    intptr_t count = i->messages ? PyList_Size(i->messages) : 0;
    for (intptr_t n = 0; n < count; n++) {
        Object *message = PyList_GetItem(i->messages, n);
        Object *status = PyObject_GetAttrString(message, "status");
        Object *category = PyObject_GetAttrString(message, "category");
        Object *text = PyObject_GetAttrString(message, "msg");
        const char *words = PyUnicode_AsUTF8AndSize(text, NULL);
        const char *kind = PyUnicode_AsUTF8AndSize(category, NULL);
        log_message(i, (int)PyLong_AsLongLong(status), kind ? kind : "", words ? words : "");
        Py_DecRef(status);
        Py_DecRef(category);
        Py_DecRef(text);
        if (PyErr_Occurred()) fetch();
    }
    if (count) PyList_SetSlice(i->messages, 0, count, NULL);
    /* Ctrl-C is the host's, which is a Python: it is raised there as soon as the call returns. */
    if (status == FMI_ERROR) PyErr_SetInterrupt();
    return status;
}

/* Result of a method, NULL with an exception set; takes the arguments over, NULL are none. An
   argument that couldn't be made has set an exception. */
static Object *call(Instance *i, const char *method, Object *first, Object *second)
{
    Object *bound = PyErr_Occurred() ? NULL : PyObject_GetAttrString(i->slave, method);
    Object *result = NULL;
    if (bound) result = PyObject_CallFunctionObjArgs(bound, first, second, (Object *)NULL);
    Py_DecRef(bound);
    Py_DecRef(first);
    Py_DecRef(second);
    return result;
}

static int new_slave(Instance *i)
{
    Object *none = PyTuple_New(0), *folder = PyUnicode_DecodeFSDefault(resources);
    Object *options = Py_BuildValue("{ss,sO}", "instance_name", i->name, "resources", folder);
    Object *slave = options ? PyObject_Call(slave_class, none, options) : NULL;
    Object *old[] = {none, folder, options, slave ? i->slave : NULL, slave ? i->messages : NULL};
    if (slave) {
        i->slave = slave;
        i->messages = PyObject_GetAttrString(slave, "log_queue");
    }
    for (int n = 0; n < 5; n++) Py_DecRef(old[n]);
    return slave != NULL;
}

/* Whether the host's logger gets a message. It gets errors even if debug logging is off; with logging
   on it may have named categories, or none for all. A host without a logger has them on stderr. */
static int wanted(const Instance *i, int status, const char *category, const char *text)
{
    int named = !i->category_count;
    for (size_t n = 0; n < i->category_count; n++) named |= !strcmp(i->categories[n], category);
    if (status < FMI_FATAL && !(named && (i->logging || status == FMI_ERROR))) return 0;
    if (!i->logger && status >= FMI_ERROR) fprintf(stderr, "%s: %s\n", i->name, text);
    return i->logger != NULL;
}

/* Sets which messages the host wants; what it names when it switches logging off doesn't matter. */
static void set_logging(Instance *i, int on, size_t count, const char *const categories[])
{
    for (size_t n = 0; n < i->category_count; n++) free(i->categories[n]);
    free(i->categories);
    i->logging = on;
    i->categories = on && count ? calloc(count, sizeof *i->categories) : NULL;
    i->category_count = i->categories ? count : 0;
    for (size_t n = 0; n < i->category_count; n++)
        i->categories[n] = strdup(categories[n] ? categories[n] : "");
}

static void drop_slave(Instance *i)
{
    Object *all[] = {i->strings, i->messages, i->slave};
    for (int n = 0; n < 3; n++) Py_DecRef(all[n]);
}

/* A new instance, or NULL with a message.

   given: the GUID or token that the host has. `refused`: why no instance is made anyway, or NULL. */
static Instance *new_instance(const char *name, const char *given, const char *refused,
                              void *environment, void *logger, int logging)
{
    Instance made = {.environment = environment, .logger = logger, .logging = logging}, *i = NULL;
    unsigned floating = default_floating();
    char text[256];
    made.name = (char *)(name ? name : "");
    if (!refused && (!given || strcmp(given, token))) {
        snprintf(text, sizeof text, "GUID or token = %.80s is refused: this FMU has %s",
                 given ? given : "NULL", token);
        refused = text;
    }
    if (refused) log_message(&made, FMI_ERROR, "logStatusError", refused);
    else if (!ready()) log_message(&made, FMI_FATAL, "logStatusFatal", failure);
    else {
        Entry entry = enter();
        int fine = new_slave(&made);
        fine = !flush(&made) && fine;
        i = fine ? malloc(sizeof *i) : NULL;
        made.name = i ? strdup(made.name) : made.name;
        if (i && made.name) *i = made;
        else {
            free(i);
            i = NULL;
            made.name = (char *)(name ? name : "");
            if (fine) log_message(&made, FMI_FATAL, "logStatusFatal", "out of memory");
            drop_slave(&made);
        }
        leave(entry);
    }
    restore_floating(floating);
    return i;
}

static void free_instance(Instance *i)
{
    if (!i) return;
    Entry entry = enter();
    drop_slave(i);
    leave(entry);
    set_logging(i, 0, 0, NULL);
    free(i->name);
    free(i);
}

/* Uses the result of a Python call, `found`; 1 if there was no exception. */
#define TAKE(result, ...)                                                                          \
    ({                                                                                             \
        Object *found = result;                                                                    \
        if (found) __VA_ARGS__;                                                                    \
        Py_DecRef(found);                                                                          \
        found != NULL;                                                                             \
    })

/* A method whose result doesn't matter. */
static int simple(Instance *i, const char *method, Object *first, Object *second)
{
    return TAKE(call(i, method, first, second), (void)0);
}

/* values[n] = converted, which reads `item`, for each item of the list that Python returned. */
#define READ(result, count, values, converted)                                                     \
    TAKE(result, for (size_t n = 0; n < (count); n++) {                                            \
        Object *item = PyList_GetItem(found, (intptr_t)n);                                         \
        if (!item) break;                                                                          \
        (values)[n] = converted;                                                                   \
    })

/* A list of so many items, each made of n. */
#define LIST(count, made)                                                                          \
    ({                                                                                             \
        Object *list = PyList_New((intptr_t)(count));                                              \
        for (size_t n = 0; list && n < (count); n++) PyList_SetItem(list, (intptr_t)n, made);      \
        list;                                                                                      \
    })

/* Signed, as pythonfmu has them: the greatest one is -1, no variable's. */
static Object *reference_list(const uint32_t references[], size_t count)
{
    return LIST(count, PyLong_FromLongLong((int32_t)references[n]));
}

/* The host's handle of a state: the slave's own object. `itself` makes an error of fmusim harmless,
   which passes the state to FreeFMUState instead of its address. */
typedef struct state {
    struct state *itself;
    Object *object;
} State;

static int keep_state(Instance *i, Object *object, void **handle)
{
    State *state = malloc(sizeof *state);
    if (!state) {
        log_message(i, FMI_ERROR, "logStatusError", "out of memory");
        return 0;
    }
    *state = (State){state, object};
    Py_IncRef(object);
    *handle = state;
    return 1;
}

static void free_state(void **handle)
{
    State *state = handle ? *handle : NULL;
    if (!state) return;
    *handle = NULL;
    Py_DecRef(state->object);
    free(state);
}

static Object *of_state(Instance *i, const char *method, const State *state)
{
    if (!state) {
        log_message(i, FMI_ERROR, "logStatusError", "a state of NULL is refused");
        return NULL;
    }
    Py_IncRef(state->object);
    return call(i, method, state->object, NULL);
}
