#include "tests/motion_blur/support.h"

#include <cmath>

#include "tests/support/variants.h"

namespace postchain::test {
namespace {

const std::string kPrefix = "0.motion_blur.";

PlanOptions whole() {
    PlanOptions options = whole_passes();
    options.outputs = {Role::color, Role::hint};
    return options;
}

template <class T>
std::map<std::string, Image<T>> without_prefix(std::map<std::string, Image<T>> stages) {
    std::map<std::string, Image<T>> result;
    for (auto& [name, stage] : stages) {
        EXPECT_EQ(name.rfind(kPrefix, 0), 0u) << name;
        result[name.substr(kPrefix.size())] = std::move(stage);
    }
    return result;
}

}  // namespace

BlurFrame::BlurFrame(int width, int height) {
    planes[Role::color] = constant_image(width, height, {0, 0, 0, 1});
    planes[Role::motion] = ImageF(width, height, 2);
    planes[Role::inverse_depth] = ImageF(width, height, 1, 1.0f);
}

void BlurFrame::set_half_velocity(int x, int y, double vx, double vy) {
    motion().at(x, y, 0) = float(4 * vx);
    motion().at(x, y, 1) = float(4 * vy);
}

void BlurFrame::set_all_half_velocities(double vx, double vy) {
    for (int y = 0; y < height(); ++y)
        for (int x = 0; x < width(); ++x) set_half_velocity(x, y, vx, vy);
}

void BlurFrame::set_gray(int x, int y, float value) {
    for (int c = 0; c < 3; ++c) color().at(x, y, c) = value;
}

BlurFrame random_frame(int width, int height, float longest, float ratio, uint32_t seed) {
    BlurFrame frame(width, height);
    frame.color() = noise_image(width, height, 4, seed);
    frame.motion() = noise_image(width, height, 2, seed + 1, -4 * longest, 4 * longest);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x)
            frame.depth().at(x, y) = (x / 5 + y / 3) % 2 == 0 ? 1.0f : ratio;
    return frame;
}

Chain blur(const Values& values) {
    Values all = {{"mode", "guertin"}};
    all.insert(all.end(), values.begin(), values.end());
    return Variant{.name = "motion_blur", .links = {{"motion_blur", all}}}.chain();
}

Chain plain_blur(const Values& values) {
    Values all = {{"jitter", 0.0}, {"tile_jitter", false}};
    all.insert(all.end(), values.begin(), values.end());
    return blur(all);
}

ImageF blurred(const Chain& chain, const BlurFrame& frame) {
    return filter(chain, describe(frame.planes), frame.planes, {.elide = false})[Role::color];
}

std::map<std::string, ImageF> stages_of(const Chain& chain, const BlurFrame& frame) {
    return without_prefix(
        filter_with_stages(chain, describe(frame.planes), frame.planes, whole()).stages);
}

std::map<std::string, ImageD> reference_stages_of(const Chain& chain, const BlurFrame& frame) {
    return without_prefix(reference(chain, describe(frame.planes), frame.planes, whole()).stages);
}

void expect_reference(const Chain& chain, const BlurFrame& frame, double share) {
    const Difference difference =
        compare(blurred(chain, frame), reference_stages_of(chain, frame).at("color"), 1e-3);
    EXPECT_LE(difference.fraction, share) << difference.text;
}

void expect_pixel(const ImageF& image, int x, int y, const std::vector<double>& expected,
                  double bound) {
    ASSERT_TRUE(image.inside(x, y));
    for (size_t c = 0; c < expected.size(); ++c)
        EXPECT_NEAR(double(image.at(x, y, int(c))), expected[c],
                    bound * std::max(1.0, std::abs(expected[c])))
            << "at " << x << "," << y << " channel " << c;
}

}  // namespace postchain::test
