/* sdg.h: grasps that were taught from one photo, found in pictures. docs/c.md is the guide.
 *
 * Generated from crates/capi/src by a test: change the sources, then run the test with SDG_WRITE_HEADER=1.
 *
 * Handles. Models, cameras and detections are numbers; each is freed once, with sdg_free, in any order. A handle that was freed, or
 * is of another kind of object, gives SDG_ERROR_HANDLE. Pointers must be NULL or point to memory as each function describes it.
 *
 * Threads. Every function may be called from any thread at any time, and handles may be shared. A detection uses one thread per core,
 * or sdg_options.threads. Detections that run at the same time share the threads unless they set a number. sdg_last_error is per
 * thread. A process that is forked after a model was loaded, or a detection or teaching was made, must call exec,
 * otherwise it gets SDG_ERROR_FORKED.
 *
 * Errors. Every function but sdg_abi_version and sdg_last_error returns SDG_OK or the kind of an error; results are written only
 * with SDG_OK. No exception is thrown, and no panic leaves the library.
 */
#ifndef SDG_H
#define SDG_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Version of this header's functions and structures, and number in the shared library's name. The library rejects
 * structures of another version. */
#define SDG_ABI_VERSION 1u

/* A model, a camera, or the detections of a picture: a number that is never reused. 0 is no object. */
typedef uint64_t sdg_handle;

/* SDG_OK or the kind of an error; sdg_last_error gives the text. */
typedef int32_t sdg_status;

/* No error. */
#define SDG_OK 0

/* A value that a function does not accept. */
#define SDG_ERROR_ARGUMENT 1

/* A file that does not exist, or cannot be read or written. */
#define SDG_ERROR_FILE 2

/* A file that is not a grasp model, is damaged, or has another version. */
#define SDG_ERROR_MODEL_FILE 3

/* Invalid bit depth, size, channels or rows of a picture. */
#define SDG_ERROR_PICTURE 4

/* An invalid camera file; or a camera for a model that was taught without one. */
#define SDG_ERROR_CAMERA 5

/* A region that is empty, not inside the picture, or too small for the part. */
#define SDG_ERROR_REGION 6

/* A photo or marks unsuitable for teaching. */
#define SDG_ERROR_TEACHING 7

/* No accepted detection; only from sdg_detections_best. */
#define SDG_ERROR_NOTHING_TO_GRASP 8

/* A handle that was freed, that never existed, or that is of another kind of object. */
#define SDG_ERROR_HANDLE 9

/* The program was compiled with a header of another ABI version. */
#define SDG_ERROR_VERSION 10

/* An internal error of this library. */
#define SDG_ERROR_INTERNAL 11

/* The process was forked after its parent had loaded a model, detected or taught. */
#define SDG_ERROR_FORKED 12

/* sdg_picture.order: red first. Ignored for grey. */
#define SDG_RGB 0u

/* sdg_picture.order: blue first, as in OpenCV's Mat. */
#define SDG_BGR 1u

/* sdg_options.region_kind: the region that the model was taught with; the whole picture if it has none. */
#define SDG_REGION_OF_MODEL 0u

/* sdg_options.region_kind: the whole picture. */
#define SDG_REGION_ALL 1u

/* sdg_options.region_kind: the numbers of sdg_options.region. */
#define SDG_REGION_PART 2u

/* sdg_detection.frame: no camera; all numbers of the pose are 0. */
#define SDG_FRAME_NONE 0u

/* sdg_detection.frame: the table, z up. */
#define SDG_FRAME_TABLE 1u

/* sdg_detection.frame: the robot's base. */
#define SDG_FRAME_BASE 2u

/* sdg_detection.turn_source: a source unknown to this header. */
#define SDG_TURN_OTHER 0u

/* sdg_detection.turn_source: the network's angle class of the box's crop (model A). */
#define SDG_TURN_CROP 1u

/* sdg_detection.turn_source: the line through the keypoints (models B and C). */
#define SDG_TURN_KEYPOINTS 2u

/* sdg_detection.turn_source: the part's texture (model D). */
#define SDG_TURN_TEXTURE 3u

/* sdg_detection.turn_source: the mask's outline (model D). */
#define SDG_TURN_OUTLINE 4u

/* sdg_detection.turn_source: search over all angles (model S, and parts of other models that only the search found). */
#define SDG_TURN_SEARCH 5u

/* sdg_teaching.symmetry: the part looks the same at every angle. */
#define SDG_SYMMETRY_FULL 4294967295u

/* Bytes of sdg_detection.refused. */
#define SDG_REFUSED_BYTES 128u

/* A picture of the caller, read only during the call. The first row is at the top, and the first pixel of a row at the
 * left. */
typedef struct {
    /* SDG_ABI_VERSION. */
    uint32_t abi_version;
    /* Width in pixels. */
    uint32_t width;
    /* Height: number of rows. */
    uint32_t height;
    /* Bytes per pixel: 3, or 1 for grey. */
    uint32_t channels;
    /* Bits per channel: 8. */
    uint32_t bits_per_channel;
    /* SDG_RGB or SDG_BGR. */
    uint32_t order;
    /* Bytes from the start of a row to the start of the next; at least width * channels. */
    size_t row_bytes;
    /* Number of bytes readable from pixels on. */
    size_t num_bytes;
    /* First byte of the first row. */
    const uint8_t *pixels;
} sdg_picture;

/* Search options. NULL is equivalent to all numbers 0 except abi_version. */
typedef struct {
    /* SDG_ABI_VERSION. */
    uint32_t abi_version;
    /* Number of threads, at most 1024; 0 for one per core. The results do not depend on it. */
    uint32_t threads;
    /* The calibrated camera that took the picture, for poses in metres; 0 for none. */
    sdg_handle camera;
    /* SDG_REGION_OF_MODEL, SDG_REGION_ALL or SDG_REGION_PART. */
    uint32_t region_kind;
    /* Left edge, upper edge, width and height in pixels; with SDG_REGION_PART. */
    uint32_t region[4];
} sdg_options;

/* Inputs of a teaching run. Numbers that are 0 and pointers that are NULL select the defaults of `sdg teach`; photo
 * and marks must be given. */
typedef struct {
    /* SDG_ABI_VERSION. */
    uint32_t abi_version;
    /* Number of angles at which the part looks the same: 2 for half a turn, ..., SDG_SYMMETRY_FULL for a disc; 0 and 1
     * for none. */
    uint32_t symmetry;
    /* File of the photo. */
    const char *photo;
    /* File of the marks, in LabelMe or COCO format. */
    const char *marks;
    /* The model's letter: "S" takes seconds; NULL selects "C", whose network takes half a minute or more. */
    const char *model;
    /* File of the calibrated camera that took the photo, for poses in metres; NULL for none. */
    const char *camera;
    /* Height of the marks above the table in metres, with a camera. */
    double mark_height_m;
    /* Height above the table at which the gripper closes, in metres, with a camera; 0 for half of mark_height_m. */
    double grasp_height_m;
    /* Seed of the random numbers; 0 for 1, the default of `sdg teach`. */
    uint64_t seed;
    /* Number of training steps of a network; 0 for the model's default. */
    uint64_t steps;
} sdg_teaching;

/* Contributions of each kind of evidence to the score, in log-odds. NaN: not evaluated. */
typedef struct {
    /* The network's proposals; NaN for models without one. */
    double network;
    /* Edges of the photo found in the picture. */
    double edges;
    /* Colours inside the outline. */
    double surface;
    /* Hue. */
    double hue;
    /* Fraction of the part in agreeing regions. */
    double visible;
    /* Size compared with the expected one. */
    double size;
    /* Fraction of the part outside the picture. */
    double outside;
    /* Resemblance to other objects. */
    double resemblance;
    /* Likeness to the photo, by the comparison network. */
    double likeness;
    /* Details, by the network trained on look-alikes. */
    double details;
    /* Table at places where the part should be. */
    double table;
    /* Fraction of the outline without an edge. */
    double rim;
    /* Edges that are not in the photo. */
    double added;
    /* Advantage of the mirror image's fit. */
    double mirror;
} sdg_evidence;

/* A candidate position of the part. Pixels: x right, y down, centre of the first pixel at (0.5, 0.5). */
typedef struct {
    /* Calibrated, from 0 to 1; accepted from 0.5. */
    double score;
    /* The network's own score; NaN without a network (model S). */
    double network_score;
    /* Agreement of the demonstration with the picture, from 0 to 1. */
    double agreement;
    /* The part's size relative to its nominal size; NaN with a camera. */
    double size;
    /* Left, upper, right and lower edge, in pixels. */
    double bounds[4];
    /* x of the grasp point, in pixels. */
    double grasp_x;
    /* y of the grasp point, in pixels. */
    double grasp_y;
    /* Direction from the first mark to the second, in (-180, 180], y down; the jaws close across it. */
    double grasp_angle_deg;
    /* The part's width between the jaws, in pixels. */
    double grasp_width_px;
    /* Grasp point in the frame, in metres. */
    double p_m[3];
    /* Rotation about the frame's z, right-handed. */
    double yaw_deg;
    /* Distance between the jaws for the part's width, in metres. */
    double opening_m;
    /* The position is within this distance with a probability of 68 %. */
    double sigma_mm;
    /* The rotation is within this angle with a probability of 68 %. */
    double sigma_deg;
    /* The components of the score. */
    sdg_evidence evidence;
    /* SDG_FRAME_TABLE or SDG_FRAME_BASE with a camera, SDG_FRAME_NONE without. */
    uint32_t frame;
    /* 1 if it is accepted, 0 if it is refused. */
    uint32_t is_accepted;
    /* SDG_TURN_CROP, ...: the source of the angle's first estimate. */
    uint32_t turn_source;
    /* Number of corners of the outline; see sdg_detections_polygon. */
    uint32_t num_polygon;
    /* Number of keypoints; see sdg_detections_keypoints. */
    uint32_t num_keypoints;
    /* Why it is refused, in UTF-8; empty if it is accepted. */
    char refused[128];
} sdg_detection;

/* The library's SDG_ABI_VERSION. */
uint32_t sdg_abi_version(void);

/* Call this first, with SDG_ABI_VERSION of the header: SDG_ERROR_VERSION if the library has another version. */
sdg_status sdg_check_abi(uint32_t abi_version);

/* Copies the text of the calling thread's last error to buffer, in UTF-8, truncated if necessary and always
 * zero-terminated. Returns the size of the complete text with its zero byte. buffer may be NULL. The library
 * keeps the text until the thread's next error. */
size_t sdg_last_error(char *buffer, size_t num_bytes);

/* Reads the file of a grasp model. */
sdg_status sdg_model_load(const char *file, sdg_handle *model);

/* Writes a model's file atomically. An existing file is replaced only if it is a grasp model. */
sdg_status sdg_model_save(sdg_handle model, const char *file);

/* Teaches a model like `sdg teach`, on all cores, which takes seconds or minutes. */
sdg_status sdg_teach(const sdg_teaching *from, sdg_handle *model);

/* Reads the file of a calibrated camera with its pose over the table, as written by `sdg camera calibrate` and `sdg
 * camera table`. */
sdg_status sdg_camera_load(const char *file, sdg_handle *camera);

/* Detects the part in a picture; its pixels are copied first. A picture without the part is not an error. options may
 * be NULL. */
sdg_status sdg_detect(sdg_handle model, const sdg_picture *picture, const sdg_options *options, sdg_handle *detections);

/* Gives the number of detections, including refused ones. */
sdg_status sdg_detections_count(sdg_handle detections, size_t *count);

/* Gives the detection with an index, from 0, in order of decreasing score. */
sdg_status sdg_detections_get(sdg_handle detections, size_t idx, sdg_detection *found);

/* Gives the best accepted detection; SDG_ERROR_NOTHING_TO_GRASP if there is none. */
sdg_status sdg_detections_best(sdg_handle detections, sdg_detection *found);

/* Copies x and y of the outline's corners in pixels, at most max_points of the detection's num_polygon. numbers may be
 * NULL if nothing is copied. */
sdg_status sdg_detections_polygon(sdg_handle detections, size_t idx, double *numbers, size_t max_points);

/* Copies x and y in pixels and the network's score of each keypoint, at most max_points of the detection's
 * num_keypoints. numbers may be NULL if nothing is copied. */
sdg_status sdg_detections_keypoints(sdg_handle detections, size_t idx, double *numbers, size_t max_points);

/* Copies all detections to buffer, in the same way as sdg_last_error: the array of `sdg detect --json`, with unrounded
 * numbers. The size of the complete text with its zero byte is written to needed, unless that is NULL. */
sdg_status sdg_detections_json(sdg_handle detections, char *buffer, size_t num_bytes, size_t *needed);

/* Frees a model, a camera or detections. The handle is invalid from then on; calls in other threads that began before
 * complete normally. */
sdg_status sdg_free(sdg_handle handle);

#ifdef __cplusplus
}
#endif

#endif
