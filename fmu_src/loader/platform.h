/* Differences between systems, compilers and processors. It runs on Linux (x86-64, aarch64) and, under
   wine, as Windows code; for macOS it is compiled, and untried. */

#define _GNU_SOURCE
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#include <windows.h>
#define DATA_SECTION ".section .rdata,\"dr\"\n"
#define OF_ADDRESS                                                                                 \
    (GET_MODULE_HANDLE_EX_FLAG_FROM_ADDRESS | GET_MODULE_HANDLE_EX_FLAG_UNCHANGED_REFCOUNT)
#define EXPORT __declspec(dllexport)
typedef SRWLOCK Lock;
#define UNLOCKED SRWLOCK_INIT
#define lock AcquireSRWLockExclusive
#define unlock ReleaseSRWLockExclusive
/* A value of each thread. Nothing runs when a thread ends: Windows holds its loader's lock then, for
   which a thread that has Python's may be waiting. */
typedef DWORD Slot;
#define make_slot(slot, ended) ((void)(ended), (void)(*(slot) = TlsAlloc()))
#define slot_value TlsGetValue
#define set_slot TlsSetValue
#else
#include <dlfcn.h>
#include <pthread.h>
#define DATA_SECTION ".section .rodata\n"
#define EXPORT __attribute__((visibility("default")))
typedef pthread_mutex_t Lock;
#define UNLOCKED PTHREAD_MUTEX_INITIALIZER
#define lock pthread_mutex_lock
#define unlock pthread_mutex_unlock
typedef pthread_key_t Slot;
#define make_slot(slot, ended) ((void)pthread_key_create(slot, ended))
#define slot_value pthread_getspecific
#define set_slot pthread_setspecific
#endif

#ifdef __APPLE__
#undef DATA_SECTION
#define DATA_SECTION ".const\n"
#endif

#ifndef RTLD_DEEPBIND /* of glibc alone */
#define RTLD_DEEPBIND 0
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
#elif defined(__aarch64__)
static inline void restore_floating(unsigned before)
{
    __asm__ volatile("msr fpcr, %0" : : "r"((uint64_t)before));
}
static inline unsigned default_floating(void)
{
    uint64_t before;
    __asm__ volatile("mrs %0, fpcr" : "=r"(before));
    restore_floating(0);
    return (unsigned)before;
}
#else
static inline unsigned default_floating(void) { return 0; }
static inline void restore_floating(unsigned before) { (void)before; }
#endif

/* The bytes of a file, from name up to name_end. */
#define EMBED(name, file)                                                                          \
    __asm__(DATA_SECTION #name ": .incbin \"" file "\"\n" #name "_end:\n.text\n");                 \
    extern const unsigned char name[] __asm__(#name);                                              \
    extern const unsigned char name##_end[] __asm__(#name "_end");

/* The path of the library with this address, UTF-8 and with slashes; 0 if it is unknown. */
static inline int find_library(void *address, char *path, size_t size)
{
#ifdef _WIN32
    HMODULE library;
    wchar_t wide[4096];
    if (!GetModuleHandleExW(OF_ADDRESS, address, &library)) return 0;
    DWORD length = GetModuleFileNameW(library, wide, 4096);
    if (!length || length == 4096) return 0;
    if (!WideCharToMultiByte(CP_UTF8, 0, wide, -1, path, (int)size, NULL, NULL)) return 0;
    for (char *c = path; *c; c++)
        if (*c == '\\') *c = '/';
#else
    Dl_info info;
    if (!dladdr(address, &info)) return 0;
    snprintf(path, size, "%s", info.dli_fname);
#endif
    return 1;
}
