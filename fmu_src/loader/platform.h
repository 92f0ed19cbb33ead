/* Differences between systems and compilers. It runs on Linux; for Windows and macOS it is
   compiled, and untried. */

#define _GNU_SOURCE
#include <pthread.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#define SLASH '\\'
#define RTLD_NOW 0
#define RTLD_LOCAL 0
#define RTLD_NODELETE 0
#define RTLD_DEFAULT NULL
#define dlopen(name, mode) ((void *)LoadLibraryA(((void)(mode), name)))
#define dlsym(library, name) \
    ((void *)GetProcAddress((library) ? (HMODULE)(library) : GetModuleHandleA("python3.dll"), name))
#define dlerror() "the private Python can't be loaded"
#define DATA_SECTION ".section .rdata,\"dr\"\n"
#else
#include <dlfcn.h>
#define SLASH '/'
#define DATA_SECTION ".section .rodata\n"
#endif

#ifdef __APPLE__
#undef DATA_SECTION
#define DATA_SECTION ".const\n"
#endif

#ifndef RTLD_DEEPBIND /* of glibc alone */
#define RTLD_DEEPBIND 0
#endif

#ifndef __clang__
#define _Thread_local __thread
#endif

/* The floating point environment of a host may trap NaN, flush small numbers to 0 or round otherwise:
   calls into Python have the default one, and leave the host's as it was. */
#ifdef __x86_64__
static inline unsigned default_floating(void)
{
    unsigned before = __builtin_ia32_stmxcsr();
    __builtin_ia32_ldmxcsr(0x1F80);
    return before;
}
static inline void restore_floating(unsigned before) { __builtin_ia32_ldmxcsr(before); }
#else
static inline unsigned default_floating(void) { return 0; }
static inline void restore_floating(unsigned before) { (void)before; }
#endif

/* The bytes of a file, from name up to name_end. */
#define EMBED(name, file)                                                                          \
    __asm__(DATA_SECTION #name ": .incbin \"" file "\"\n" #name "_end:\n.text\n");                 \
    extern const unsigned char name[] __asm__(#name);                                              \
    extern const unsigned char name##_end[] __asm__(#name "_end");

/* Where the library with this address lies; 0 if it is unknown. */
static inline int find_library(void *address, char *path, size_t size)
{
#ifdef _WIN32
    HMODULE library;
    DWORD flags = GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS;
    return GetModuleHandleExA(flags, address, &library) &&
           GetModuleFileNameA(library, path, (DWORD)size);
#else
    Dl_info info;
    if (!dladdr(address, &info)) return 0;
    snprintf(path, size, "%s", info.dli_fname);
    return 1;
#endif
}
