/* Preloaded: C++ objects of the size of pythonfmu's own state can't be accessed once they are freed,
   so a use after free ends the process every time. */

#define _GNU_SOURCE
#include <stdlib.h>
#include <sys/mman.h>

enum { PAGE = 4096, PAGES = 1 << 14, LEAST = 96, MOST = 192 };

static char *region;
static size_t used;

__attribute__((constructor)) static void reserve(void)
{
    int flags = MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE;
    region = mmap(NULL, (size_t)PAGE * PAGES, PROT_READ | PROT_WRITE, flags, -1, 0);
    if (region == MAP_FAILED) abort();
}

/* operator new(unsigned long): in a page of its own */
void *_Znwm(size_t size)
{
    size_t page = size >= LEAST && size <= MOST ? __atomic_fetch_add(&used, 1, __ATOMIC_RELAXED) : PAGES;
    void *memory = region && page < PAGES ? region + page * PAGE : malloc(size);
    if (!memory) abort();
    return memory;
}

/* operator delete(void *) */
void _ZdlPv(void *memory)
{
    char *at = memory;
    if (region && at >= region && at < region + (size_t)PAGE * PAGES) mprotect(at, PAGE, PROT_NONE);
    else free(memory);
}

/* operator delete(void *, unsigned long) */
void _ZdlPvm(void *memory, size_t size) { _ZdlPv(memory); }
