// Preloaded into `sdg` by tests/endurance/src/soak.rs: writes the heap's bytes in use to $HEAP_FILE a hundred times a second.
#include <fcntl.h>
#include <malloc.h>
#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static void *watch(void *file) {
    char text[21];
    for (;;) {
        snprintf(text, sizeof text, "%20zu", mallinfo2().uordblks);
        if (pwrite(*(int *)file, text, 20, 0) != 20)
            return NULL;
        usleep(10000);
    }
}

__attribute__((constructor)) static void begin(void) {
    static int file;
    pthread_t thread;
    const char *name = getenv("HEAP_FILE");
    if (name && (file = open(name, O_WRONLY | O_CREAT | O_CLOEXEC, 0644)) >= 0)
        pthread_create(&thread, NULL, watch, &file);
}
