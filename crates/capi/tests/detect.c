/* Prints all fields of all detections as JSON with the names of `sdg detect --json`, one line per picture, each followed by the line
 * that the library writes itself. Usage: detect MODEL CAMERA|- THREADS PICTURE.ppm... */
#include <math.h>
#include <sdg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ppm.h"

static void check(sdg_status status) {
    if (status != SDG_OK) {
        char text[1024];
        sdg_last_error(text, sizeof text);
        fprintf(stderr, "error %d: %s\n", (int)status, text);
        exit(1);
    }
}

/* 17 digits represent the number exactly. */
static void number(const char *name, double value) {
    printf("\"%s\":%.17g,", name, value);
}

static void number_or_null(const char *name, double value) {
    if (isnan(value)) {
        printf("\"%s\":null,", name);
    } else {
        number(name, value);
    }
}

static void number_or_nothing(const char *name, double value) {
    if (!isnan(value)) {
        number(name, value);
    }
}

static void rows(const char *name, const double *numbers, size_t count, size_t columns) {
    printf("\"%s\":[", name);
    for (size_t row = 0; row < count; row++) {
        for (size_t column = 0; column < columns; column++) {
            printf("%s%.17g", column > 0 ? "," : row > 0 ? ",[" : "[", numbers[row * columns + column]);
        }
        printf("]");
    }
    printf("],");
}

static void print_detection(sdg_handle detections, size_t idx) {
    static const char *const turn_sources[] = {"", "crop", "keypoints", "texture", "outline", "search"};
    sdg_detection found;
    check(sdg_detections_get(detections, idx, &found));
    double *polygon = malloc(sizeof(double) * (2 * found.num_polygon + 1));
    double *keypoints = malloc(sizeof(double) * (3 * found.num_keypoints + 1));
    check(sdg_detections_polygon(detections, idx, polygon, found.num_polygon));
    check(sdg_detections_keypoints(detections, idx, keypoints, found.num_keypoints));

    printf("{");
    number("score", found.score);
    number_or_null("network_score", found.network_score);
    number_or_null("agreement", found.agreement);
    number_or_nothing("size", found.size);
    printf("\"box\":[%.17g,%.17g,%.17g,%.17g],", found.bounds[0], found.bounds[1], found.bounds[2], found.bounds[3]);
    rows("keypoints", keypoints, found.num_keypoints, 3);
    if (found.num_polygon > 0) {
        rows("polygon", polygon, found.num_polygon, 2);
    }
    if (found.frame != SDG_FRAME_NONE) {
        printf("\"pose\":{\"frame\":\"%s\",", found.frame == SDG_FRAME_BASE ? "base" : "table");
        printf("\"p_m\":[%.17g,%.17g,%.17g],", found.p_m[0], found.p_m[1], found.p_m[2]);
        number("yaw_deg", found.yaw_deg);
        number("opening_m", found.opening_m);
        number("sigma_mm", found.sigma_mm);
        printf("\"sigma_deg\":%.17g},", found.sigma_deg);
    }
    printf("\"grasp\":{");
    number("x", found.grasp_x);
    number("y", found.grasp_y);
    number("angle_deg", found.grasp_angle_deg);
    printf("\"width_px\":%.17g},\"evidence\":{", found.grasp_width_px);
    number_or_nothing("network", found.evidence.network);
    number("edges", found.evidence.edges);
    number("surface", found.evidence.surface);
    number("hue", found.evidence.hue);
    number("visible", found.evidence.visible);
    number("size", found.evidence.size);
    number("outside", found.evidence.outside);
    number("resemblance", found.evidence.resemblance);
    number("likeness", found.evidence.likeness);
    number("details", found.evidence.details);
    number("table", found.evidence.table);
    number("rim", found.evidence.rim);
    number("added", found.evidence.added);
    printf("\"mirror\":%.17g},", found.evidence.mirror);
    if (!found.is_accepted) {
        printf("\"refused\":\"%s\",", found.refused);
    } else if (found.refused[0] != 0) {
        fprintf(stderr, "expected no reason for refusal of an accepted detection, found %s\n", found.refused);
        exit(1);
    }
    printf("\"turn_source\":\"%s\"}", turn_sources[found.turn_source]);
    free(polygon);
    free(keypoints);
}

int main(int argc, char **argv) {
    if (argc < 5) {
        fprintf(stderr, "usage: detect MODEL CAMERA|- THREADS PICTURE.ppm...\n");
        return 2;
    }
    check(sdg_check_abi(SDG_ABI_VERSION));
    sdg_handle model, camera = 0;
    check(sdg_model_load(argv[1], &model));
    if (strcmp(argv[2], "-") != 0) {
        check(sdg_camera_load(argv[2], &camera));
    }
    sdg_options options = {.abi_version = SDG_ABI_VERSION, .threads = (uint32_t)atoi(argv[3]), .camera = camera};

    for (int i = 4; i < argc; i++) {
        sdg_picture picture = {
            .abi_version = SDG_ABI_VERSION, .channels = 3, .bits_per_channel = 8, .order = SDG_RGB};
        uint8_t *pixels = read_ppm(argv[i], &picture.width, &picture.height);
        picture.pixels = pixels;
        picture.row_bytes = 3 * (size_t)picture.width;
        picture.num_bytes = picture.row_bytes * picture.height;
        sdg_handle detections;
        check(sdg_detect(model, &picture, &options, &detections));
        free(pixels);

        size_t count, num_bytes;
        check(sdg_detections_count(detections, &count));
        printf("[");
        for (size_t idx = 0; idx < count; idx++) {
            printf("%s", idx > 0 ? "," : "");
            print_detection(detections, idx);
        }
        printf("]\n");

        check(sdg_detections_json(detections, NULL, 0, &num_bytes));
        char *json = malloc(num_bytes);
        check(sdg_detections_json(detections, json, num_bytes, NULL));
        printf("%s\n", json);
        free(json);
        check(sdg_free(detections));
    }
    if (camera != 0) {
        check(sdg_free(camera));
    }
    check(sdg_free(model));
    return 0;
}
