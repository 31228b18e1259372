/* Reads binary PPM pictures with 8 bits per channel, so that the tests' pixels do not depend on another library. */
#ifndef PPM_H
#define PPM_H

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

/* The pixels, to be freed by the caller; exits if the file has none. */
static uint8_t *read_ppm(const char *file, uint32_t *width, uint32_t *height) {
    FILE *in = fopen(file, "rb");
    if (in == NULL || fscanf(in, "P6 %u %u 255", width, height) != 2 || fgetc(in) != '\n') {
        fprintf(stderr, "expected a binary PPM picture, found %s\n", file);
        exit(2);
    }
    size_t num_bytes = (size_t)3 * *width * *height;
    uint8_t *pixels = (uint8_t *)malloc(num_bytes);
    if (pixels == NULL || fread(pixels, 1, num_bytes, in) != num_bytes) {
        fprintf(stderr, "expected %zu bytes of pixels in %s\n", num_bytes, file);
        exit(2);
    }
    fclose(in);
    return pixels;
}

#endif
