/* A Python of the FMU's own, for hosts that have none.

   This library is shared by all FMUs of one build in a process: it is found by its soname, which has
   a digest of all that it needs. It links libpython and the extension modules, so that their symbols
   are found in its own scope and nowhere else: libpython in the global scope would be taken for that
   of a host that starts its own Python later.

   The standard library is frozen in here, and every FMU adds its own modules. Nothing is read from
   the folder of an FMU, which may be deleted while another one still runs. */

#include <Python.h>
#include "platform.h"

/* The frozen modules: name, 0, 1 for a package else 0, length in four bytes, code; again and again. */
EMBED(frozen, "standard_library.bin")

static Lock starting = UNLOCKED;
static Slot held; /* the thread's state */
static PyThreadState *first;

/* The modules' init functions, written by the build: X(math) X(_json) ... */
#define X(name) PyObject *PyInit_##name(void);
EXTENSIONS
#undef X

static int known(const struct _frozen *table, const char *name)
{
    for (; table && table->name; table++)
        if (!strcmp(table->name, name)) return 1;
    return 0;
}

/* The table is replaced, never changed: an import may be looking at the old one. */
static int add_modules(const unsigned char *at, const unsigned char *end)
{
    const struct _frozen *old = PyImport_FrozenModules;
    size_t count = 0, more = 0;
    while (old && old[count].name) count++;
    for (const unsigned char *p = at; p < end; more++) {
        p += strlen((const char *)p) + 2;
        p += 4 + (p[0] | p[1] << 8 | p[2] << 16 | p[3] << 24);
    }
    struct _frozen *table = calloc(count + more + 1, sizeof *table);
    if (!table) return 0;
    if (count) memcpy(table, old, count * sizeof *table);
    size_t before = count;
    while (at < end) {
        const char *name = (const char *)at;
        at += strlen(name) + 1;
        int package = *at++, size = at[0] | at[1] << 8 | at[2] << 16 | at[3] << 24;
        at += 4;
        if (!known(old, name)) {
            table[count].name = name;
            table[count].code = at;
#if PY_VERSION_HEX >= 0x030B0000
            table[count].size = size;
            table[count].is_package = package;
#else
            table[count].size = package ? -size : size;
#endif
            count++;
        }
        at += size;
    }
    if (count == before) free(table);
    else PyImport_FrozenModules = table;
    return 1;
}

/* When a thread ends, Python's own record of its state has been cleared: PyGILState_Release would
   abort. Not that of the thread which started Python: Python 3.11 dies without it. */
static void let_go(void *state)
{
    if (state == first) return;
    PyEval_RestoreThread(state);
    PyThreadState_Clear(state);
    PyThreadState_DeleteCurrent();
}

static int start(void)
{
    PyPreConfig before;
    PyConfig config;
    PyStatus status;
    PyPreConfig_InitIsolatedConfig(&before);
    before.utf8_mode = 1; /* paths, whatever the host's locale is */
    status = Py_PreInitialize(&before);
    if (PyStatus_Exception(status)) return 0;
#define X(name) PyImport_AppendInittab(#name, PyInit_##name);
    EXTENSIONS
#undef X
    /* Isolated: no environment variables, no signal handlers, no command line. */
    PyConfig_InitIsolatedConfig(&config);
    config.site_import = 0;
    config.write_bytecode = 0;
    config.module_search_paths_set = 1;
    /* If given, they aren't searched for on the host's disk. */
    wchar_t **places[] = {&config.executable, &config.base_executable, &config.prefix,
                          &config.base_prefix, &config.exec_prefix, &config.base_exec_prefix,
                          &config.home};
    for (size_t n = 0; n < sizeof places / sizeof *places; n++)
        PyConfig_SetString(&config, places[n], L"/");
    status = Py_InitializeFromConfig(&config);
    PyConfig_Clear(&config);
    if (PyStatus_Exception(status)) return 0;
    first = PyEval_SaveThread();
    return 1;
}

/* Starts Python unless it runs, and adds an FMU's modules; 0 if that fails. Never Py_Finalize: at
   the end of the process threads of the host may still step. */
EXPORT int private_python_start(const unsigned char *modules, const unsigned char *end)
{
    int fine = 1;
    lock(&starting);
    if (!Py_IsInitialized()) {
        make_slot(&held, let_go);
        fine = add_modules(frozen, frozen_end) && start();
    }
    if (fine) {
        PyGILState_STATE outer = PyGILState_Ensure();
#ifdef _WIN32
        /* A host may unload the FMU, whose folder can be deleted only then. The names of its modules
           have a digest: if the first one is known, all are. */
        size_t size = known(PyImport_FrozenModules, (const char *)modules) ? 0 : end - modules;
        unsigned char *kept = malloc(size + 1);
        fine = kept != NULL;
        if (fine) modules = memcpy(kept, modules, size), end = kept + size;
#endif
        fine = fine && add_modules(modules, end);
        PyGILState_Release(outer);
    }
    unlock(&starting);
    return fine;
}

/* A thread that Python didn't start has no thread state: each PyGILState_Ensure would make one, and
   each release drop it, which is ten times the cost of a call. One more Ensure keeps it until the
   thread ends; on Windows, until the process ends. */
EXPORT void private_python_hold(void)
{
    if (slot_value(held)) return;
    PyGILState_Ensure();
    set_slot(held, PyThreadState_Get());
    PyEval_SaveThread();
}
