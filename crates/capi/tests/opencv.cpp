// Detects in OpenCV's Mat (blue first; padded rows in a part of another Mat), in two threads that share a model.
// Prints the detections of each picture as written by the library. Usage: opencv MODEL PICTURE.ppm...
#include <opencv2/core.hpp>
#include <sdg.h>

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "ppm.h"

namespace {

void check(sdg_status status) {
    if (status != SDG_OK) {
        std::vector<char> text(sdg_last_error(nullptr, 0));
        sdg_last_error(text.data(), text.size());
        std::cerr << "error " << status << ": " << text.data() << '\n';
        std::exit(1);
    }
}

sdg_picture picture_of(const cv::Mat &mat) {
    sdg_picture picture{};
    picture.abi_version = SDG_ABI_VERSION;
    picture.width = static_cast<uint32_t>(mat.cols);
    picture.height = static_cast<uint32_t>(mat.rows);
    picture.channels = static_cast<uint32_t>(mat.channels());
    picture.bits_per_channel = static_cast<uint32_t>(8 * mat.elemSize1());
    picture.order = SDG_BGR;
    picture.row_bytes = mat.step;
    picture.num_bytes = static_cast<size_t>(mat.dataend - mat.data);
    picture.pixels = mat.data;
    return picture;
}

std::string detect(sdg_handle model, const cv::Mat &mat, uint32_t threads) {
    const sdg_picture picture = picture_of(mat);
    sdg_options options{};
    options.abi_version = SDG_ABI_VERSION;
    options.threads = threads;
    sdg_handle detections = 0;
    check(sdg_detect(model, &picture, &options, &detections));
    size_t num_bytes = 0;
    check(sdg_detections_json(detections, nullptr, 0, &num_bytes));
    std::vector<char> json(num_bytes);
    check(sdg_detections_json(detections, json.data(), json.size(), nullptr));
    check(sdg_free(detections));
    return json.data();
}

}  // namespace

int main(int argc, char **argv) {
    check(sdg_check_abi(SDG_ABI_VERSION));
    sdg_handle model = 0;
    check(sdg_model_load(argv[1], &model));
    for (int i = 2; i < argc; i++) {
        uint32_t width = 0, height = 0;
        uint8_t *pixels = read_ppm(argv[i], &width, &height);
        cv::Mat wide(static_cast<int>(height) + 4, static_cast<int>(width) + 10, CV_8UC3, cv::Scalar(1, 2, 3));
        cv::Mat part = wide(cv::Rect(7, 3, static_cast<int>(width), static_cast<int>(height)));
        for (int y = 0; y < part.rows; y++) {
            for (int x = 0; x < part.cols; x++) {
                const uint8_t *rgb = pixels + 3 * (static_cast<size_t>(y) * width + static_cast<size_t>(x));
                part.at<cv::Vec3b>(y, x) = cv::Vec3b(rgb[2], rgb[1], rgb[0]);
            }
        }
        std::free(pixels);
        std::string of_threads[2];
        std::thread first([&] { of_threads[0] = detect(model, part, 1); });
        std::thread second([&] { of_threads[1] = detect(model, part.clone(), 1); });
        first.join();
        second.join();
        if (of_threads[0] != of_threads[1]) {
            std::cerr << "expected equal detections for a part and its copy, found " << of_threads[0] << " and " << of_threads[1] << '\n';
            return 1;
        }
        std::cout << of_threads[0] << '\n';
    }
    check(sdg_free(model));
}
