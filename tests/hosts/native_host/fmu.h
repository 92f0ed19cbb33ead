/* Loads an FMU and calls it (here FMI 2.0), for the hosts in this folder. */

#define _GNU_SOURCE
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2FunctionTypes.h"

#ifdef _WIN32
#include <windows.h>
#include <shellapi.h>
#define BINARY_2 "binaries/win64/%s.dll"
#define BINARY_3 "binaries/x86_64-windows/%s.dll"
#define FILE_URI "file:///"
#define RTLD_NOW 0
#define RTLD_LOCAL 0
#define RTLD_GLOBAL 0
#define dlsym(library, name) ((void *)(intptr_t)GetProcAddress(library, name))
static inline const char *dlerror(void)
{
    static char text[64];
    snprintf(text, sizeof text, "Windows error %lu", GetLastError());
    return text;
}

static inline void *dlopen(const char *name, int mode)
{
    wchar_t path[4096];
    (void)mode;
    MultiByteToWideChar(CP_UTF8, 0, name, -1, path, 4096);
    return LoadLibraryW(path);
}

/* The command line in UTF-8. */
static inline void read_arguments(int *argc, char ***argv)
{
    wchar_t **wide = CommandLineToArgvW(GetCommandLineW(), argc);
    *argv = calloc(*argc + 1, sizeof **argv);
    for (int n = 0; n < *argc; n++) {
        (*argv)[n] = malloc(4096);
        WideCharToMultiByte(CP_UTF8, 0, wide[n], -1, (*argv)[n], 4096, NULL, NULL);
    }
}
#else
#include <dlfcn.h>
#define BINARY_2 "binaries/linux64/%s.so"
#define FILE_URI "file://"
#ifdef __aarch64__
#define BINARY_3 "binaries/aarch64-linux/%s.so"
#else
#define BINARY_3 "binaries/x86_64-linux/%s.so"
#endif
#define read_arguments(argc, argv) ((void)(argc), (void)(argv))
#endif

/* A function of a library by its name in the standard. */
#define CALL(library, name) ((name##TYPE *)symbol(library, #name))

static inline void fail(const char *what)
{
    fprintf(stderr, "failed: %s\n", what ? what : "");
    exit(1);
}

static inline void *symbol(void *library, const char *name)
{
    void *found = dlsym(library, name);
    if (!found) fail(name);
    return found;
}

static inline void *load_binary(const char *folder, const char *binary, const char *name)
{
    char file[4096];
    snprintf(file, sizeof file, "%s/", folder);
    snprintf(file + strlen(file), sizeof file - strlen(file), binary, name);
    void *library = dlopen(file, RTLD_NOW | RTLD_LOCAL);
    if (!library) fail(dlerror());
    return library;
}

static inline void *load(const char *folder, const char *name)
{
    return load_binary(folder, BINARY_2, name);
}

static inline void log_message(fmi2ComponentEnvironment environment, fmi2String instance,
                               fmi2Status status, fmi2String category, fmi2String message, ...)
{
    va_list arguments;
    (void)environment, (void)instance, (void)status, (void)category;
    va_start(arguments, message);
    vfprintf(stderr, message, arguments);
    fputc('\n', stderr);
    va_end(arguments);
}

static const fmi2CallbackFunctions callbacks = {log_message, calloc, free, NULL, NULL};

static inline fmi2Component instantiate(void *library, const char *folder, const char *guid,
                                        const char *name)
{
    char resources[4096];
    snprintf(resources, sizeof resources, FILE_URI "%s/resources", folder);
    fmi2Component c = CALL(library, fmi2Instantiate)(name, fmi2CoSimulation, guid, resources,
                                                     &callbacks, fmi2False, fmi2True);
    if (!c) fail("instantiate");
    return c;
}

static inline void initialize(void *library, fmi2Component c)
{
    if (CALL(library, fmi2SetupExperiment)(c, fmi2False, 0.0, 0.0, fmi2False, 0.0) != fmi2OK)
        fail("set up");
    if (CALL(library, fmi2EnterInitializationMode)(c) != fmi2OK) fail("enter initialization");
    if (CALL(library, fmi2ExitInitializationMode)(c) != fmi2OK) fail("exit initialization");
}
