/* no_threads.c: linked into the tests of no_races (test/CMakeLists.txt), which the run under the
 * thread sanitizer leaves out. One that starts a thread after all ends here. */
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>

int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                          void *(*start)(void *), void *argument);

int __wrap_pthread_create(pthread_t *thread, const pthread_attr_t *attributes,
                          void *(*start)(void *), void *argument) {
    (void)thread;
    (void)attributes;
    (void)start;
    (void)argument;
    fputs(
        "this test starts a thread: take it out of no_races in test/CMakeLists.txt, so that races "
        "are looked for in it\n",
        stderr);
    abort();
}
