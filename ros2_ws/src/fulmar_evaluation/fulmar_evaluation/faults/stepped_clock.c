/* Lets the clock of one process step: CLOCK_REALTIME is ahead by as many nanoseconds as a file says.
 *
 * Preloaded into every node of a system; it acts in the one whose command line has FULMAR_STEPPED_NODE. Waits until an
 * absolute time of that clock are taken back by the step, since the kernel's own clock stays as it was.
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <semaphore.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#define SECOND 1000000000LL
#define EPOCH 1000000000LL /* seconds; times of a monotonic clock are smaller */

static volatile int64_t none = 0;
static volatile int64_t *step = &none;

__attribute__((constructor)) static void begin(void)
{
    static char words[1 << 16];
    const char *node = getenv("FULMAR_STEPPED_NODE"), *path = getenv("FULMAR_CLOCK_STEP");
    int file = open("/proc/self/cmdline", O_RDONLY);
    ssize_t length = file < 0 ? -1 : read(file, words, sizeof words - 1);
    if (file >= 0)
        close(file);
    if (node == NULL || path == NULL || length <= 0 || memmem(words, length, node, strlen(node)) == NULL)
        return;
    file = open(path, O_RDONLY);
    if (file < 0)
        return;
    void *shared = mmap(NULL, sizeof(int64_t), PROT_READ, MAP_SHARED, file, 0);
    close(file);
    if (shared != MAP_FAILED)
        step = shared;
}

static struct timespec later(struct timespec at, int64_t by)
{
    int64_t ns = at.tv_sec * SECOND + at.tv_nsec + by;
    return (struct timespec){ns / SECOND, ns % SECOND};
}

static struct timespec back(const struct timespec *at)
{
    return at->tv_sec > EPOCH ? later(*at, -*step) : *at;
}

#define REAL(name) ((__typeof__(&name))dlsym(RTLD_NEXT, #name))

int clock_gettime(clockid_t clock, struct timespec *at)
{
    static __typeof__(&clock_gettime) real;
    if (real == NULL)
        real = REAL(clock_gettime);
    int failed = real(clock, at);
    if (!failed && (clock == CLOCK_REALTIME || clock == CLOCK_REALTIME_COARSE))
        *at = later(*at, *step);
    return failed;
}

int gettimeofday(struct timeval *restrict at, void *restrict zone)
{
    struct timespec now;
    (void)zone;
    clock_gettime(CLOCK_REALTIME, &now);
    *at = (struct timeval){now.tv_sec, now.tv_nsec / 1000};
    return 0;
}

time_t time(time_t *at)
{
    struct timespec now;
    clock_gettime(CLOCK_REALTIME, &now);
    if (at != NULL)
        *at = now.tv_sec;
    return now.tv_sec;
}

int pthread_cond_timedwait(pthread_cond_t *restrict condition, pthread_mutex_t *restrict mutex,
                           const struct timespec *restrict at)
{
    struct timespec due = back(at);
    return REAL(pthread_cond_timedwait)(condition, mutex, &due);
}

int pthread_mutex_timedlock(pthread_mutex_t *restrict mutex, const struct timespec *restrict at)
{
    struct timespec due = back(at);
    return REAL(pthread_mutex_timedlock)(mutex, &due);
}

int sem_timedwait(sem_t *restrict semaphore, const struct timespec *restrict at)
{
    struct timespec due = back(at);
    return REAL(sem_timedwait)(semaphore, &due);
}
