/* Teaches a model and saves it. Usage: teach PHOTO MARKS LETTER STEPS CAMERA|- MARK_HEIGHT_M OUT */
#include <sdg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int main(int argc, char **argv) {
    if (argc != 8) {
        return 2;
    }
    sdg_teaching from = {.abi_version = SDG_ABI_VERSION, .photo = argv[1], .marks = argv[2], .model = argv[3]};
    from.steps = strtoull(argv[4], NULL, 10);
    if (strcmp(argv[5], "-") != 0) {
        from.camera = argv[5];
        from.mark_height_m = atof(argv[6]);
    }
    sdg_handle model;
    sdg_status status = sdg_teach(&from, &model);
    if (status == SDG_OK) {
        status = sdg_model_save(model, argv[7]);
        sdg_free(model);
    }
    if (status != SDG_OK) {
        char text[1024];
        sdg_last_error(text, sizeof text);
        fprintf(stderr, "error %d: %s\n", (int)status, text);
        return 1;
    }
    return 0;
}
