#include "tests/layers/support.h"

#include <algorithm>
#include <cmath>

#include "tests/support/wheels_crop.h"

namespace postchain::test {
TestFrame bright_frame(int width, int height) {
    TestFrame frame = layered_frame(width, height, {23.0f, -11.0f}, {-3.0f, 5.0f}, 5);
    ImageF& color = frame.planes.at(Role::color);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const bool lamp = (x / 3 + y / 2) % 11 == 0, hole = (x + 2 * y) % 17 < 3;
            for (int c = 0; c < 4; ++c) {
                if (lamp && c < 3) color.at(x, y, c) *= 40;
                if (hole) color.at(x, y, c) *= 0.25f;
            }
        }
    frame.description = describe(frame.planes);
    frame.description.camera.f_stop = 0.2;
    return frame;
}

TestFrame traced_frame() {
    TestFrame frame;
    frame.planes = read_wheels_crop().planes;
    frame.description = describe(frame.planes);
    frame.description.camera.f_stop = 1;
    frame.description.camera.focus_distance = 6;
    return frame;
}

void add_matte(TestFrame& frame, const ImageF& matte, size_t passes) {
    frame.planes[Role::mattes] = matte;
    frame.description.planes.add(Role::mattes);
    frame.description.mattes.assign(passes, 0);
    for (const Neighbor neighbor : kNeighbors) {
        if (!frame.planes.count(role_of(neighbor, Role::color))) continue;
        frame.planes[role_of(neighbor, Role::mattes)] = matte;
        frame.description.planes.add(role_of(neighbor, Role::mattes));
    }
}

ImageF square_matte(int width, int height, int soft_px) {
    ImageF matte(width, height, 1);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            const int out_x = std::max({width / 3 - x, x - (2 * width / 3 - 1), 0});
            const int out_y = std::max({height / 3 - y, y - (2 * height / 3 - 1), 0});
            const int out = std::max(out_x, out_y);
            matte.at(x, y) = out == 0 ? 1.0f : std::max(0.0f, 1 - float(out) / float(soft_px + 1));
        }
    return matte;
}

ImageF sum_of(const ImageF& layers, int height) {
    ImageF sum(layers.width, height, 4);
    for (int i = 0; i < layers.height / height; ++i) {
        const ImageF layer = plane_of_stack(layers, i, height);
        for (size_t k = 0; k < sum.data.size(); ++k) sum.data[k] += layer.data[k];
    }
    return sum;
}

double relative_difference(const ImageF& a, const ImageF& b) {
    if (a.width != b.width || a.height != b.height || a.data.size() != b.data.size())
        return INFINITY;
    double scale = 1e-30, largest = 0;
    for (const float value : b.data) scale = std::max(scale, std::abs(double(value)));
    for (size_t i = 0; i < a.data.size(); ++i) {
        const double difference = std::abs(double(a.data[i]) - double(b.data[i]));
        if (!(difference <= largest)) largest = std::isnan(difference) ? INFINITY : difference;
    }
    return largest / scale;
}

void expect_reference_and_sum(const Chain& chain, const TestFrame& frame) {
    const FramePlanes out = filter(chain, frame.description, frame.planes);
    const ReferenceFrame expected = reference(chain, frame.description, frame.planes);
    for (const Role role : {Role::color, Role::layers}) {
        const Difference difference = compare(out.at(role), expected.planes.at(role), 2e-3);
        EXPECT_LE(difference.fraction, 0.02) << name_of(role) << ": " << difference.text;
    }
    const ImageF& color = out.at(Role::color);
    EXPECT_LE(relative_difference(sum_of(out.at(Role::layers), color.height), color), 1e-5);
}

std::vector<NamedChain> every_mode() {
    std::vector<NamedChain> all;
    const auto add = [&](const std::string& type, Settings settings) {
        std::string name = type;
        for (const auto& [key, value] : settings) name += " " + key + "=" + text_of(value);
        all.push_back({name, chain_of(type, settings)});
    };
    add("motion_blur", {});
    add("motion_blur", {{"neighbors", "none"}});
    add("motion_blur", {{"mode", "guertin"}});
    add("motion_blur", {{"mode", "guertin"}, {"jitter", 0.0}, {"tile_jitter", false}});
    add("motion_blur", {{"mode", "guertin"}, {"sample_split", "variance"}});
    add("motion_blur", {{"mode", "guertin"}, {"velocity_storage", "unorm8"}});
    add("motion_blur", {{"mode", "single"}, {"border", "clamp"}});
    add("depth_of_field", {});
    add("depth_of_field", {{"denoise", false}, {"samples", int64_t(40)}});
    // Wide enough for the denoising, in such a small frame.
    add("depth_of_field", {{"max_radius_px", 14.0}});
    add("joint_blur", {{"max_radius_px", 14.0}});
    add("depth_of_field", {{"aperture_blades", int64_t(5)}, {"cats_eye", 0.5}});
    for (const char* leak : {"none", "depth", "coc"})
        for (const bool weight : {false, true})
            add("depth_of_field", {{"method", "gilham"}, {"leak", leak}, {"hdr_weight", weight}});
    add("depth_of_field",
        {{"method", "gilham"}, {"downsample", int64_t(1)}, {"blur_sigma_px", 2.0}});
    // Boxes of several pixels, whose weights color decides.
    add("depth_of_field", {{"method", "gilham"},
                           {"downsample", int64_t(4)},
                           {"blur_sigma_px", 5.0},
                           {"hdr_weight", true}});
    add("joint_blur", {});
    add("joint_blur", {{"samples", int64_t(48)}, {"denoise", false}});
    add("joint_blur", {{"samples", int64_t(8)}, {"max_samples", int64_t(40)}});
    for (const char* mode : {"search", "directional"})
        for (const char* blend : {"tonemapped", "stored"})
            for (const char* luma : {"display", "stored"})
                add("fxaa", {{"mode", mode}, {"blend", blend}, {"luma", luma}});
    for (const char* hint : {"checkerboard", "threshold"}) {
        NamedChain blurred{concat("guertin, fxaa hint=", hint),
                           chain_of("motion_blur", {{"mode", "guertin"}})};
        append(blurred.chain, "fxaa", {{"hint", hint}});
        all.push_back(std::move(blurred));
    }
    NamedChain dim{"motion_blur, gilham, fxaa hint=checkerboard", chain_of("motion_blur")};
    append(dim.chain, "depth_of_field", {{"method", "gilham"}});
    append(dim.chain, "fxaa", {{"hint", "checkerboard"}, {"hint_gate", "pixel"}});
    all.push_back(std::move(dim));
    NamedChain warped{"joint_blur, fxaa, motion_blur", chain_of("joint_blur")};
    append(warped.chain, "fxaa", {{"mode", "directional"}});
    append(warped.chain, "motion_blur");
    all.push_back(std::move(warped));
    return all;
}

}  // namespace postchain::test
