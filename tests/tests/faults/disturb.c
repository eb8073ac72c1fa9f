/* Loaded before libc: has the clock of the day step, and what writes below a folder be slow or fail, as a shared file says.
 *
 * ISOTHERM_DISTURB: that file, three native 64-bit numbers (see disturb.rs). ISOTHERM_DISTURBED: the folder. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

struct told {
    volatile int64_t step_ns, slow_us, fails_with;
};

static struct told nothing;
static struct told *told = &nothing;
static const char *folder = "";

__attribute__((constructor)) static void begin(void) {
    const char *path = getenv("ISOTHERM_DISTURB");
    int fd = path ? open(path, O_RDONLY) : -1;
    if (fd >= 0) {
        void *at = mmap(NULL, sizeof nothing, PROT_READ, MAP_SHARED, fd, 0);
        if (at != MAP_FAILED)
            told = at;
        close(fd);
    }
    if (getenv("ISOTHERM_DISTURBED"))
        folder = getenv("ISOTHERM_DISTURBED");
}

/* Whether a call fails, after the time that the disk takes. */
static int fails(int is_below) {
    if (!is_below)
        return 0;
    int64_t us = told->slow_us;
    if (us > 0) {
        struct timespec wait = {us / 1000000, us % 1000000 * 1000};
        nanosleep(&wait, NULL);
    }
    if (told->fails_with == 0)
        return 0;
    errno = (int)told->fails_with;
    return 1;
}

static int is_active(void) { return folder[0] && (told->slow_us > 0 || told->fails_with != 0); }

static int is_below(const char *path) { return is_active() && strncmp(path, folder, strlen(folder)) == 0; }

static int is_file_below(int fd) {
    char link[64], path[PATH_MAX + 1];
    struct stat status;
    if (!is_active() || fstat(fd, &status) != 0 || !S_ISREG(status.st_mode))
        return 0;
    snprintf(link, sizeof link, "/proc/self/fd/%d", fd);
    ssize_t length = readlink(link, path, PATH_MAX);
    if (length < 0)
        return 0;
    path[length] = 0;
    return is_below(path);
}

#define NEXT(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

int clock_gettime(clockid_t clock, struct timespec *time) {
    static int (*next)(clockid_t, struct timespec *);
    if (!next)
        next = NEXT(clock_gettime);
    int result = next(clock, time);
    int64_t step = told->step_ns;
    if (result == 0 && step != 0 && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE)) {
        int64_t ns = time->tv_nsec + step % 1000000000;
        time->tv_sec += step / 1000000000 + (ns >= 1000000000) - (ns < 0);
        time->tv_nsec = ns - 1000000000 * ((ns >= 1000000000) - (ns < 0));
    }
    return result;
}

#define WRITES(flags) (((flags) & (O_WRONLY | O_RDWR | O_CREAT)) != 0)

#define OPEN(name)                                                                                                     \
    int name(const char *path, int flags, ...) {                                                                       \
        va_list rest;                                                                                                  \
        va_start(rest, flags);                                                                                         \
        mode_t mode = va_arg(rest, mode_t);                                                                            \
        va_end(rest);                                                                                                  \
        if (WRITES(flags) && fails(is_below(path)))                                                                    \
            return -1;                                                                                                 \
        return NEXT(name)(path, flags, mode);                                                                          \
    }
OPEN(open)
OPEN(open64)

ssize_t write(int fd, const void *bytes, size_t count) {
    return fails(is_file_below(fd)) ? -1 : NEXT(write)(fd, bytes, count);
}

int fsync(int fd) { return fails(is_file_below(fd)) ? -1 : NEXT(fsync)(fd); }

int fdatasync(int fd) { return fails(is_file_below(fd)) ? -1 : NEXT(fdatasync)(fd); }

int rename(const char *from, const char *to) { return fails(is_below(to)) ? -1 : NEXT(rename)(from, to); }

int unlink(const char *path) { return fails(is_below(path)) ? -1 : NEXT(unlink)(path); }
