/* sdg.h: grasps that were taught from one photo, found in pictures. docs/c.md is the guide.
 *
 * Written by a test from crates/capi/src: change those, then run it with SDG_WRITE_HEADER=1.
 *
 * Handles. Models, cameras and detections are numbers; each is freed once, with sdg_free, in any order. A handle that was freed, or
 * is of another object, is SDG_ERROR_HANDLE and does no harm. What must be true: pointers are NULL or point to what a function says.
 *
 * Threads. Every function may be called from any thread at any time, and handles may be shared. A detection computes on as many threads
 * as there are cores, or as sdg_options.threads says; all callers without such a number share theirs. sdg_last_error is the calling
 * thread's own. A process that is forked after a detection or a teaching must call exec, or gets SDG_ERROR_FORKED.
 *
 * Errors. Every function but sdg_abi_version and sdg_last_error gives SDG_OK or the kind of an error; results are written with SDG_OK
 * alone. Nothing is thrown, and no panic crosses the border.
 */
#ifndef SDG_H
#define SDG_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version of this header's functions and structures; the number in the shared library's name. A library refuses structures of another. */
#define SDG_ABI_VERSION 1u

/* A model, a camera, or the detections of a picture: a number that is given once and never again. 0 is none. */
typedef uint64_t sdg_handle;

/* SDG_OK or the kind of an error, whose text sdg_last_error gives. */
typedef int32_t sdg_status;

/* No error. */
#define SDG_OK 0

/* A value that a function does not take. */
#define SDG_ERROR_ARGUMENT 1

/* A file that is not there, or that cannot be read or written. */
#define SDG_ERROR_FILE 2

/* A file that is no grasp model, a damaged one, or one of another version. */
#define SDG_ERROR_MODEL_FILE 3

/* A picture's bits, size, channels or rows. */
#define SDG_ERROR_PICTURE 4

/* A camera's file; a camera given to a model that was taught without. */
#define SDG_ERROR_CAMERA 5

/* A region that does not lie in the picture. */
#define SDG_ERROR_REGION 6

/* A photo and marks that nothing can be taught from. */
#define SDG_ERROR_TEACHING 7

/* No part in the picture; from sdg_detections_best alone. */
#define SDG_ERROR_NOTHING_TO_GRASP 8

/* A handle that was freed, that was never given, or that is of another object. */
#define SDG_ERROR_HANDLE 9

/* A program that was compiled with the header of another ABI version. */
#define SDG_ERROR_VERSION 10

/* A fault of this library. */
#define SDG_ERROR_INTERNAL 11

/* A process that was forked after its parent had detected or taught. */
#define SDG_ERROR_FORKED 12

/* sdg_picture.order: red first. Of no meaning for grey. */
#define SDG_RGB 0u

/* sdg_picture.order: blue first, as in OpenCV's Mat. */
#define SDG_BGR 1u

/* sdg_options.region_kind: the region that the model was taught with; all of the picture where it has none. */
#define SDG_REGION_OF_MODEL 0u

/* sdg_options.region_kind: all of the picture. */
#define SDG_REGION_ALL 1u

/* sdg_options.region_kind: the numbers of sdg_options.region. */
#define SDG_REGION_PART 2u

/* sdg_detection.frame: without a camera; all numbers of the pose are 0. */
#define SDG_FRAME_NONE 0u

/* sdg_detection.frame: the table, z up. */
#define SDG_FRAME_TABLE 1u

/* sdg_detection.frame: the robot's base. */
#define SDG_FRAME_BASE 2u

/* sdg_detection.turn_source: a source that this header does not know. */
#define SDG_TURN_OTHER 0u

/* sdg_detection.turn_source: the network's class of the box's crop (model A). */
#define SDG_TURN_CROP 1u

/* sdg_detection.turn_source: the line through the keypoints (models B and C). */
#define SDG_TURN_KEYPOINTS 2u

/* sdg_detection.turn_source: the part's texture (model D). */
#define SDG_TURN_TEXTURE 3u

/* sdg_detection.turn_source: the mask's outline (model D). */
#define SDG_TURN_OUTLINE 4u

/* sdg_detection.turn_source: every turn was tried (model S). */
#define SDG_TURN_SEARCH 5u

/* sdg_teaching.symmetry: the part looks the same at every turn. */
#define SDG_SYMMETRY_FULL 4294967295u

/* Bytes of sdg_detection.refused. */
#define SDG_REFUSED_BYTES 128u

/* A picture of the caller's, read during the call alone. The upper row is the first, the left pixel of a row is the first. */
typedef struct {
    /* SDG_ABI_VERSION. */
    uint32_t abi_version;
    /* Pixels of a row. */
    uint32_t width;
    /* Number of rows. */
    uint32_t height;
    /* Bytes of a pixel: 3, or 1 for grey. */
    uint32_t channels;
    /* Bits of a channel: 8. */
    uint32_t bits_per_channel;
    /* SDG_RGB or SDG_BGR. */
    uint32_t order;
    /* Bytes from the start of a row to the start of the next; at least width * channels. */
    size_t row_bytes;
    /* Bytes that may be read from pixels on. */
    size_t num_bytes;
    /* First byte of the first row. */
    const uint8_t *pixels;
} sdg_picture;

/* How a picture is searched. NULL in its place is the same as all numbers 0 but abi_version. */
typedef struct {
    /* SDG_ABI_VERSION. */
    uint32_t abi_version;
    /* Number of threads, at most 1024; 0 for as many as there are cores. It changes no digit of a result. */
    uint32_t threads;
    /* The calibrated camera that took the picture, for poses in metres; 0 for none. */
    sdg_handle camera;
    /* SDG_REGION_OF_MODEL, SDG_REGION_ALL or SDG_REGION_PART. */
    uint32_t region_kind;
    /* Left edge, upper edge, width and height in pixels; with SDG_REGION_PART. */
    uint32_t region[4];
} sdg_options;

/* What a model is taught from. Numbers that are 0 and pointers that are NULL have the defaults of `sdg teach`. */
typedef struct {
    /* SDG_ABI_VERSION. */
    uint32_t abi_version;
    /* Turns after which the part looks the same: 2 for half a turn, ..., SDG_SYMMETRY_FULL for a disc; 0 and 1 for none. */
    uint32_t symmetry;
    /* File of the photo. */
    const char *photo;
    /* File of the marks, LabelMe's or COCO's. */
    const char *marks;
    /* The model's letter: "S" takes seconds; NULL is "C", whose network takes minutes. */
    const char *model;
    /* File of the calibrated camera that took the photo, for poses in metres; NULL for none. */
    const char *camera;
    /* Height of the marks over the table in metres, with a camera. */
    double mark_height_m;
    /* Height over the table at which the gripper closes, in metres, with a camera; 0 for half of mark_height_m. */
    double grasp_height_m;
    /* Seed of the random numbers; 0 for 1, the default of `sdg teach`. */
    uint64_t seed;
    /* Training steps of a network; 0 for the model's own number. */
    uint64_t steps;
} sdg_teaching;

/* Contributions of each kind of evidence to the score, in log-odds. NaN: of a kind that was not asked. */
typedef struct {
    /* The network's proposals; NaN for models without one. */
    double network;
    /* Edges of the photo that the picture has. */
    double edges;
    /* Colours inside the outline. */
    double surface;
    /* Hue. */
    double hue;
    /* Share of the part in regions that agree. */
    double visible;
    /* Size beside the expected one. */
    double size;
    /* Share of the part outside the picture. */
    double outside;
    /* Resemblance to other things. */
    double resemblance;
    /* Likeness to the photo by the comparing network. */
    double likeness;
    /* Details by the network that knows look-alikes. */
    double details;
    /* Table where the part should be. */
    double table;
    /* Share of the outline without an edge. */
    double rim;
    /* Edges that the photo does not have. */
    double added;
    /* How much better the mirror image fits. */
    double mirror;
} sdg_evidence;

/* A place where the part may lie. Pixels: x right, y down, the middle of the first pixel at (0.5, 0.5). */
typedef struct {
    /* From 0 to 1, calibrated: from 0.5 on it is accepted. */
    double score;
    /* The network's own score; NaN where no network was asked (model S). */
    double network_score;
    /* How well the demonstration agrees with the picture, from 0 to 1. */
    double agreement;
    /* The part's size over its nominal size; NaN with a camera. */
    double size;
    /* Left, upper, right and lower edge, in pixels. */
    double bounds[4];
    /* Grasp point, in pixels. */
    double grasp_x;
    /* Grasp point, in pixels. */
    double grasp_y;
    /* Direction from the first mark to the second, in (-180, 180], y down; the jaws close across it. */
    double grasp_angle_deg;
    /* The part's width between the jaws, in pixels. */
    double grasp_width_px;
    /* Grasp point in the frame, in metres. */
    double p_m[3];
    /* Turn about the frame's z, right-handed. */
    double yaw_deg;
    /* Distance between the jaws for the part's width, in metres. */
    double opening_m;
    /* The position lies within this with a probability of 68 %. */
    double sigma_mm;
    /* The turn lies within this with a probability of 68 %. */
    double sigma_deg;
    /* What the score is made of. */
    sdg_evidence evidence;
    /* SDG_FRAME_TABLE or SDG_FRAME_BASE with a camera, SDG_FRAME_NONE without. */
    uint32_t frame;
    /* 1 where it is accepted, 0 where it is refused. */
    uint32_t is_accepted;
    /* SDG_TURN_CROP, ...: the first source of the turn. */
    uint32_t turn_source;
    /* Corners of the outline; sdg_detections_polygon gives them. */
    uint32_t num_polygon;
    /* Keypoints; sdg_detections_keypoints gives them. */
    uint32_t num_keypoints;
    /* Why it is refused, in UTF-8; empty where it is accepted. */
    char refused[128];
} sdg_detection;

/* The library's SDG_ABI_VERSION. */
uint32_t sdg_abi_version(void);

/* To be called first with SDG_ABI_VERSION, the header's: SDG_ERROR_VERSION where the library has another. */
sdg_status sdg_check_abi(uint32_t abi_version);

/* Copies the text of the calling thread's last error into buffer, in UTF-8, cut off where there is no room, always ended by a zero
 * byte. Gives the number of bytes of all of it with the zero byte. buffer may be NULL. The text stays until the thread's next error. */
size_t sdg_last_error(char *buffer, size_t num_bytes);

/* Reads the file of a grasp model. */
sdg_status sdg_model_load(const char *file, sdg_handle *model);

/* Writes a model's file, whole or not at all. It replaces a grasp model or nothing. */
sdg_status sdg_model_save(sdg_handle model, const char *file);

/* Teaches a model as `sdg teach` does. It computes on all cores, for seconds or minutes. */
sdg_status sdg_teach(const sdg_teaching *from, sdg_handle *model);

/* Reads the file of a calibrated camera with its pose over the table, as `sdg camera calibrate` and `sdg camera table` write it. */
sdg_status sdg_camera_load(const char *file, sdg_handle *camera);

/* Finds the part in a picture, whose pixels are copied first. A picture without the part is no error here. options may be NULL. */
sdg_status sdg_detect(sdg_handle model, const sdg_picture *picture, const sdg_options *options, sdg_handle *detections);

/* The number of detections, the refused ones with them. */
sdg_status sdg_detections_count(sdg_handle detections, size_t *count);

/* A detection by its number, from 0; the best score first. */
sdg_status sdg_detections_get(sdg_handle detections, size_t idx, sdg_detection *found);

/* The best of the accepted detections; SDG_ERROR_NOTHING_TO_GRASP where there is none. */
sdg_status sdg_detections_best(sdg_handle detections, sdg_detection *found);

/* Copies x and y of the outline's corners in pixels, at most max_points of the num_polygon that a detection has. */
sdg_status sdg_detections_polygon(sdg_handle detections, size_t idx, double *numbers, size_t max_points);

/* Copies x and y in pixels and the network's score of the keypoints, at most max_points of the num_keypoints that a detection has. */
sdg_status sdg_detections_keypoints(sdg_handle detections, size_t idx, double *numbers, size_t max_points);

/* Copies all detections as the array of `sdg detect --json`, with every digit, into buffer as sdg_last_error does. The number of bytes of
 * all of it with the zero byte is written to needed, unless that is NULL. */
sdg_status sdg_detections_json(sdg_handle detections, char *buffer, size_t num_bytes, size_t *needed);

/* Frees a model, a camera or detections. The handle is an error from then on; calls in other threads that began before still end well. */
sdg_status sdg_free(sdg_handle handle);

#ifdef __cplusplus
}
#endif

#endif
