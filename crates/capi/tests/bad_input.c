/* Wrong input: prints the name, the status and the error text of each call. Usage: bad_input MODEL CAMERA DAMAGED PHOTO.ppm */
#include <sdg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ppm.h"

static void report(const char *name, sdg_status status) {
    char text[1024] = "";
    if (status != SDG_OK) {
        sdg_last_error(text, sizeof text);
    }
    printf("%s|%d|%s\n", name, (int)status, text);
}

static sdg_handle model;

static void detect(const char *name, sdg_picture picture, sdg_options options) {
    sdg_handle detections = 77;
    sdg_status status = sdg_detect(model, &picture, &options, &detections);
    report(name, status);
    if (status == SDG_OK) {
        sdg_free(detections);
    } else if (detections != 77) {
        printf("%s wrote a result in spite of its error\n", name);
    }
}

int main(int argc, char **argv) {
    if (argc != 5) {
        return 2;
    }
    sdg_handle other, camera, detections;
    sdg_detection found;
    sdg_picture photo = {.abi_version = SDG_ABI_VERSION, .channels = 3, .bits_per_channel = 8, .order = SDG_RGB};
    uint8_t *pixels = read_ppm(argv[4], &photo.width, &photo.height);
    photo.pixels = pixels;
    photo.row_bytes = 3 * (size_t)photo.width;
    photo.num_bytes = photo.row_bytes * photo.height;
    sdg_options options = {.abi_version = SDG_ABI_VERSION, .threads = 1};
    sdg_picture p;
    sdg_options o;

    report("abi_own", sdg_check_abi(SDG_ABI_VERSION));
    report("abi_old", sdg_check_abi(SDG_ABI_VERSION - 1));
    report("model_missing", sdg_model_load("/no/such.sdg", &model));
    report("model_damaged", sdg_model_load(argv[3], &model));
    report("model_other_file", sdg_model_load(argv[4], &model));
    report("model_null_path", sdg_model_load(NULL, &model));
    report("model_null_result", sdg_model_load(argv[1], NULL));
    report("camera_missing", sdg_camera_load("/no/such.yaml", &camera));
    report("camera_other_file", sdg_camera_load(argv[4], &camera));
    report("model", sdg_model_load(argv[1], &model));
    report("camera", sdg_camera_load(argv[2], &camera));
    report("save_over_picture", sdg_model_save(model, argv[4]));

    p = photo, p.abi_version = 0, detect("picture_old", p, options);
    o = options, o.abi_version = 0, detect("options_old", photo, o);
    p = photo, p.channels = 4, detect("channels", p, options);
    p = photo, p.bits_per_channel = 16, detect("bits", p, options);
    p = photo, p.order = 2, detect("order", p, options);
    p = photo, p.width = 0, detect("no_width", p, options);
    p = photo, p.width = p.height = 4294967295u, detect("too_large", p, options);
    p = photo, p.row_bytes = 3 * p.width - 1, detect("stride", p, options);
    p = photo, p.row_bytes = (size_t)-1, detect("stride_overflow", p, options);
    p = photo, p.num_bytes -= 1, detect("too_few_bytes", p, options);
    p = photo, p.pixels = NULL, detect("pixels_null", p, options);
    o = options, o.threads = 5000, detect("threads", photo, o);
    o = options, o.region_kind = 9, detect("region_kind", photo, o);
    o = options, o.region_kind = SDG_REGION_PART, o.region[2] = 641, o.region[3] = 10, detect("region", photo, o);
    o = options, o.camera = camera, detect("camera_of_model_without", photo, o);
    o = options, o.camera = model, detect("camera_is_model", photo, o);
    report("picture_null", sdg_detect(model, NULL, NULL, &detections));
    report("result_null", sdg_detect(model, &photo, NULL, NULL));
    report("handle_none", sdg_detect(0, &photo, NULL, &detections));
    report("handle_never_given", sdg_detect(12345678, &photo, NULL, &detections));
    report("handle_of_camera", sdg_detect(camera, &photo, NULL, &detections));

    report("detect", sdg_detect(model, &photo, &options, &detections));
    report("best", sdg_detections_best(detections, &found));
    report("best_null", sdg_detections_best(detections, NULL));
    report("idx", sdg_detections_get(detections, 1000, &found));
    report("polygon_null", sdg_detections_polygon(detections, 0, NULL, 5));
    report("polygon_null_for_none", sdg_detections_polygon(detections, 0, NULL, 0));
    /* Model S has no keypoints, so a program may have no array for them. */
    report("keypoints_null_for_none", sdg_detections_keypoints(detections, 0, NULL, found.num_keypoints));
    report("free_detections", sdg_free(detections));
    report("best_freed", sdg_detections_best(detections, &found));
    report("free_twice", sdg_free(detections));

    memset(pixels, 128, photo.num_bytes);
    report("detect_nothing", sdg_detect(model, &photo, &options, &detections));
    report("best_of_nothing", sdg_detections_best(detections, &found));
    report("free_nothing", sdg_free(detections));

    sdg_teaching teaching = {.abi_version = SDG_ABI_VERSION, .photo = "/no/photo.png", .marks = "/no/marks.json", .model = "S"};
    report("teach_missing", sdg_teach(&teaching, &other));
    teaching.model = "Z";
    report("teach_letter", sdg_teach(&teaching, &other));
    teaching.model = "S", teaching.camera = argv[2], teaching.mark_height_m = 16.0;
    report("teach_millimetres", sdg_teach(&teaching, &other));
    teaching.abi_version = 0;
    report("teach_old", sdg_teach(&teaching, &other));
    report("teach_null", sdg_teach(NULL, &other));

    report("free_model", sdg_free(model));
    report("detect_freed", sdg_detect(model, &photo, &options, &detections));
    report("free_camera", sdg_free(camera));
    free(pixels);
    return 0;
}
