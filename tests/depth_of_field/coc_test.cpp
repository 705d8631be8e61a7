// The signed circle of confusion: published numbers, its three sources on the GPU, and errors of
// incomplete configurations.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <span>

#include "chain/frame/convert.h"
#include "passes/common/circle_of_confusion.h"
#include "tests/depth_of_field/support.h"
#include "tests/support/status.h"

namespace postchain::test::coc_test {
namespace {

using namespace std::string_literals;

using lens::circle_of_confusion;
using lens::CircleOfConfusion;
using lens::CocSource;
using lens::Parameters;
using testing::HasSubstr;

constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

FrameDescription frame_1920(double focal_mm, double f_stop, double focus, double per_unit = 1) {
    FrameDescription frame;
    frame.width = frame.display_width = 1920;
    frame.height = frame.display_height = 1080;
    frame.camera.focal_length_mm = focal_mm;
    frame.camera.f_stop = f_stop;
    frame.camera.focus_distance = focus;
    frame.camera.sensor_width_mm = 36;
    frame.camera.meters_per_unit = per_unit;
    return frame;
}

double diameter(const FrameDescription& frame, bool breathing, double d) {
    Parameters parameters;
    parameters.breathing = breathing;
    parameters.max_radius_px = 1000;
    return 2 * must(circle_of_confusion(parameters, frame)).radius_px(1 / d);
}

// Diameters c = f^2/(N (s-f)) W/sensor (1 - s w) of the thin lens with refocusing, computed by
// hand: f 50 mm, N 2.8, s 5 m on 1920 px and 36 mm is 0.0025/(2.8 * 4.95) * 1920/0.036 = 9.6200 px
// at infinity (w = 0), half of it at 10 m, and -4 times it at 1 m.
// Without refocusing the diameter is smaller by (s - f)/s: at infinity c = f_px A/s with
// f_px = 50 * 1920/36 = 2666.667 px and A = 50/2.8 mm: 2666.667 * 0.017857143 / 5 = 9.5238.
TEST(circle_of_confusion, thin_lens) {
    const FrameDescription f50 = frame_1920(50, 2.8, 5);
    // A scene in centimeters: all distances times 100, the same pixels.
    const FrameDescription centimeters = frame_1920(50, 2.8, 500, 0.01);
    // An overscan data window does not change the lens: W is the display width.
    FrameDescription overscan = f50, narrow = f50;
    overscan.width = narrow.width = 2200;
    narrow.display_width = 960;
    const std::tuple<FrameDescription, bool, double, double> cases[] = {
        {f50, true, 10, 4.8100},
        {f50, true, INFINITY, 9.6200},
        {f50, true, 1, -38.4800},
        {frame_1920(85, 1.4, 2), true, INFINITY, 143.7275},
        {frame_1920(24, 8, 3), true, INFINITY, 1.2903},
        {f50, false, INFINITY, 9.52381},
        {f50, false, 1, -38.09524},
        {centimeters, true, 100, -38.4800},
        {centimeters, false, 100, -38.09524},
        {overscan, true, 10, 4.8100},
        {narrow, true, 10, 4.8100 / 2}};
    for (const auto& [frame, breathing, d, expected] : cases)
        EXPECT_NEAR(diameter(frame, breathing, d), expected, 5e-5) << d;
}

// With an infinite f-stop, every depth is in focus, even d = 0.
TEST(circle_of_confusion, pinhole) {
    FrameDescription frame = frame_1920(50, INFINITY, 5);
    const CircleOfConfusion coc = *circle_of_confusion({}, frame);
    for (const double w : {0.0, 0.1, 1e30, double(INFINITY)}) EXPECT_EQ(coc.radius_px(w), 0);
    EXPECT_EQ(coc.largest_radius_px(0, INFINITY), 0);
    frame.bounds.max_inverse_depth = 1e30;
    EXPECT_TRUE(lens::exceeded_limits(coc, frame).empty());
    for (const UsedValue& value : lens::used_values({}, coc, frame, 0.5)) {
        if (value.key == "sharp_from") {
            EXPECT_EQ(value.value, ParameterValue(0.0));
        }
        if (value.key == "sharp_to") {
            EXPECT_EQ(value.value, ParameterValue()) << "all the way";
        }
    }
}

// A range that reaches behind the camera.
TEST(used_values, sharp_from_the_camera_on) {
    Parameters parameters;
    parameters.coc = CocSource::range;
    parameters.focus = 1;
    parameters.range = 4;
    parameters.max_radius_px = 1;
    const FrameDescription frame = frame_1920(50, 2.8, 5);
    for (const UsedValue& value :
         lens::used_values(parameters, must(circle_of_confusion(parameters, frame)), frame, 0.5)) {
        if (value.key == "sharp_from") {
            EXPECT_EQ(value.value, ParameterValue(0.0));
        }
        if (value.key == "sharp_to") {
            EXPECT_EQ(value.value, ParameterValue(3.0));
        }
    }
}

// Each value with the place that it comes from, and the row that gave it if its name is another.
TEST(used_values, of_a_lens_and_of_a_range) {
    FrameDescription camera = frame_1920(50, 2.8, 5);
    camera.bounds.inverse_depth_at = {{{0.5, 0.5}, 0.25}, {{0.25, 0.5}, 0}};
    FrameDescription no_unit = camera;
    no_unit.camera.meters_per_unit.reset();
    const auto used = [](const FrameDescription& frame, void (*change)(Parameters&)) {
        Parameters parameters;
        change(parameters);
        const CircleOfConfusion coc = must(circle_of_confusion(parameters, frame));
        EXPECT_TRUE(lens::exceeded_limits(coc, frame).empty()) << "no depth is known";
        std::string text;
        for (const UsedValue& value : lens::used_values(parameters, coc, frame, 0.5)) {
            if (value.key == "sharp_from") break;
            const char* of[] = {"pass", "camera", "standard", "frame"};
            text += concat(text.empty() ? "" : ", ", value.key, " ", text_of(value.value), " ",
                           of[int(value.of)], value.row == value.key ? "" : " " + value.row);
        }
        return text;
    };
    const std::string
        lens = "focal_length_mm 50 camera, sensor_width_mm 36 camera, f_stop 2.8 camera, ",
        standard = ", max_radius_px 240 standard", small = ", max_radius_px 20 pass";
    EXPECT_EQ(used(camera, [](Parameters&) {}),
              lens + "focus_distance 5 camera, meters_per_unit 1 camera" + standard);
    EXPECT_EQ(used(no_unit,
                   [](Parameters& p) {
                       p.focal_length_mm = 35;
                       p.sensor_width_mm = 24;
                       p.f_stop = 4;
                       p.focus_distance = 3;
                       p.focus_at = {0.5, 0.5};
                       p.max_radius_px = 30;
                   }),
              "focal_length_mm 35 pass, sensor_width_mm 24 pass, f_stop 4 pass, "
              "focus_distance 3 pass, meters_per_unit 1 standard, max_radius_px 30 pass");
    EXPECT_EQ(used(camera,
                   [](Parameters& p) {
                       p.focus_at = {0.5, 0.5};
                   }),
              lens + "focus_distance 4 pass focus_at, meters_per_unit 1 camera" + standard);
    EXPECT_EQ(used(camera,
                   [](Parameters& p) {
                       p.focus_at = {0.25, 0.5};
                       p.max_radius_fraction = 0.05;
                   }),
              lens +
                  "focus_distance unset pass focus_at, meters_per_unit 1 camera, "
                  "max_radius_px 54 pass max_radius_fraction")
        << "the sky";
    const std::pair<const char*, void (*)(Parameters&)> ranges[] = {
        {"focus 5 camera focus_distance", [](Parameters&) {}},
        {"focus 3 pass", [](Parameters& p) { p.focus = 3, p.focus_distance = 2; }},
        {"focus 2 pass focus_distance",
         [](Parameters& p) {
             p.focus_distance = 2, p.focus_at = {0.5, 0.5};
         }},
        {"focus 4 pass focus_at", [](Parameters& p) {
             p.focus_at = {0.5, 0.5};
         }}};
    for (const auto& [text, change] : ranges) {
        static void (*of_range)(Parameters&);
        of_range = change;
        EXPECT_EQ(used(camera,
                       [](Parameters& p) {
                           p.coc = CocSource::range;
                           p.max_radius_px = 20;
                           of_range(p);
                       }),
                  text + small);
    }
    EXPECT_EQ(used(camera, [](Parameters& p) { p.coc = CocSource::planes; }), standard.substr(2));
}

TEST(circle_of_confusion, own_values_beat_the_camera) {
    const FrameDescription frame = frame_1920(24, 8, 3);
    Parameters own;
    own.focal_length_mm = 50;
    own.f_stop = 2.8;
    own.focus_distance = 5;
    own.breathing = true;
    const auto coc = circle_of_confusion(own, frame);
    ASSERT_TRUE(coc.ok());
    EXPECT_NEAR(2 * coc->radius_px(0.1), 4.8100, 5e-5);
    own.sensor_width_mm = 18;  // half the sensor, twice the pixels
    EXPECT_NEAR(2 * circle_of_confusion(own, frame)->radius_px(0.1), 9.6200, 5e-5);
}

TEST(circle_of_confusion, largest_radius_bounds_every_depth) {
    const FrameDescription frame = describe_round(deep_planes(4, 4));
    for (const CocSource source : {CocSource::lens, CocSource::planes, CocSource::range}) {
        Parameters parameters;
        parameters.coc = source;
        parameters.near_blurry = 1;
        parameters.near_sharp = 3;
        parameters.far_sharp = 5;
        parameters.far_blurry = 9;
        const CircleOfConfusion coc = *circle_of_confusion(parameters, frame);
        for (const auto& [low, high] :
             {std::pair{0.0, 0.1}, {0.15, 0.24}, {0.2, 0.7}, {0.4, 9.0}}) {
            double seen = 0;
            for (int i = 0; i <= 1000; ++i)
                seen = std::max(seen, std::abs(coc.radius_px(low + (high - low) * i / 1000)));
            EXPECT_GE(coc.largest_radius_px(low, high), seen);
            EXPECT_LE(coc.largest_radius_px(low, high), seen * 1.0001 + 1e-4);
            EXPECT_LE(coc.largest_radius_px(low, high), coc.largest_radius_px());
        }
    }
}

// Between the recorded depths no circle is wider than it is said to be, and beyond each one is.
TEST(circle_of_confusion, sharp_depths_are_those_of_both_sides) {
    const double radius = 0.5;
    for (const CocSource source : {CocSource::lens, CocSource::planes, CocSource::range})
        for (const auto& [near_fraction, far_fraction] : {std::pair{0.05, 0.05},
                                                          {0.05, 0.0},
                                                          {0.0, 0.05},
                                                          {0.05, 0.002},
                                                          {0.002, 0.05},
                                                          {0.05, 0.0002},
                                                          {0.0002, 0.05}}) {
            Parameters parameters;
            parameters.coc = source;
            parameters.near_blurry = 1;
            parameters.near_sharp = 3;
            parameters.far_sharp = 5;
            parameters.far_blurry = 9;
            parameters.max_near_fraction = near_fraction;
            parameters.max_far_fraction = far_fraction;
            const FrameDescription frame = frame_1920(50, 2.8, 5);
            const CircleOfConfusion coc = *circle_of_confusion(parameters, frame);
            const auto distance = [&](const std::string& key) {
                for (const UsedValue& value : lens::used_values(parameters, coc, frame, radius))
                    if (value.key == key && value.value != ParameterValue())
                        return std::get<double>(value.value);
                return double(INFINITY);
            };
            const auto radius_at = [&](double d) { return std::abs(coc.radius_px(1 / d)); };
            const double from = distance("sharp_from"), to = distance("sharp_to");
            SCOPED_TRACE(
                concat(int(source), " ", near_fraction, " ", far_fraction, ": ", from, " to ", to));
            EXPECT_LT(from, to);
            EXPECT_LE(radius_at(std::max(from, 1e-3)), radius * (1 + 1e-9));
            EXPECT_LE(radius_at(to), radius * (1 + 1e-9));
            if (from > 0) {
                EXPECT_GT(radius_at(from / 1.001), radius);
            }
            if (std::isfinite(to)) {
                EXPECT_GT(radius_at(to * 1.001), radius);
            }
        }
}

// ------------------------------------------------------------------------------ on the GPU

ImageF coc_of(const std::vector<float>& inverse_depths, Settings settings) {
    ImageF depth(int(inverse_depths.size()), 1, 1);
    depth.data = inverse_depths;
    const FramePlanes planes =
        planes_of(constant_image(depth.width, 1, {0.5f, 0.5f, 0.5f, 1}), depth);
    const ImageF coc = dof_stages(planes, settings).stages.at(stage("coc"));
    const Difference difference =
        compare(coc, dof_reference(planes, settings).stages.at(stage("coc")), 1e-5);
    EXPECT_LE(difference.max, 1e-5) << "reference: " << difference.text;
    return coc;
}

void expect_radii(const ImageF& coc, const std::vector<double>& expected) {
    ASSERT_EQ(coc.data.size(), expected.size());
    for (size_t i = 0; i < expected.size(); ++i)
        EXPECT_NEAR(coc.data[i], expected[i], 2e-5) << "pixel " << i;
}

// R = 32 (1/4 - w), |R| <= 19.2: w 0 -> 8; 1/16 -> 32 * 3/16 = 6; 1/8 -> 4; 1/4 -> 0;
// 1/2 -> -8; 3/4 -> -16; 1 -> -24, clamped to -19.2; and d -> 0 in every form.
TEST(coc_stage, lens_by_hand) {
    expect_radii(coc_of({0, 0.0625f, 0.125f, 0.25f, 0.5f, 0.75f, 1, 1e30f, kInfinity}, {}),
                 {8, 6, 4, 0, -8, -16, -19.2, -19.2, -19.2});
    // Breathing multiplies by s/(s-f) = 4/3.964.
    expect_radii(coc_of({0, 0.125f, 0.5f}, {{"breathing", true}}),
                 {8 * 4 / 3.964, 4 * 4 / 3.964, -8 * 4 / 3.964});
}

// near 1..3, far 5..9, radii 0.015 * 640 = 9.6 and 0.005 * 640 = 3.2. d = 0.5 and 1: -9.6;
// d = 2: half the ramp, -4.8; d = 3, 4, 5: 0; d = 7: half the ramp, 1.6; d = 9, 20, sky: 3.2.
TEST(coc_stage, planes_by_hand) {
    expect_radii(coc_of({2, 1, 0.5f, 1.0f / 3, 0.25f, 0.2f, 1.0f / 7, 1.0f / 9, 0.05f, 0},
                        {{"coc", "planes"s},
                         {"near_blurry", 1.0},
                         {"near_sharp", 3.0},
                         {"far_sharp", 5.0},
                         {"far_blurry", 9.0}}),
                 {-9.6, -9.6, -4.8, 0, 0, 0, 1.6, 3.2, 3.2, 3.2});
}

// |R| is clamped after the ramp, whose slope does not change: radii 0.06 * 640 = 38.4, limit 12: d
// = 2.75, an eighth: -4.8; d = 2.5, a quarter: -9.6; d = 2: -19.2, clamped to -12; d = 5.5: 4.8;
// sky: 12.
TEST(coc_stage, planes_clamped_after_the_ramp) {
    expect_radii(coc_of({0.5f, 0.4f, 1 / 2.75f, 1 / 5.5f, 0}, {{"coc", "planes"s},
                                                               {"near_blurry", 1.0},
                                                               {"near_sharp", 3.0},
                                                               {"far_sharp", 5.0},
                                                               {"far_blurry", 9.0},
                                                               {"max_near_fraction", 0.06},
                                                               {"max_far_fraction", 0.06},
                                                               {"max_radius_px", 12.0}}),
                 {-12, -9.6, -4.8, 4.8, 12});
}

// R = 10 clamp((d - 4)/2, -1, 1): d = 1: -10; 3: -5; 4: 0; 5: 5; 8 and sky: 10. The focus comes
// from `focus`, from the pass's focus_distance, or from the camera (4).
TEST(coc_stage, range_by_hand) {
    using Setting = std::pair<std::string, ParameterValue>;
    const Setting range = {"coc", "range"s}, width = {"range", 2.0}, most = {"max_radius_px", 10.0},
                  distance = {"focus_distance", 9.0}, focus = {"focus", 4.0};
    const std::vector<float> w = {1, 1.0f / 3, 0.25f, 0.2f, 0.125f, 0};
    const std::vector<double> radii = {-10, -5, 0, 5, 10, 10};
    expect_radii(coc_of(w, {range, width, most}), radii);
    expect_radii(coc_of(w, {range, width, most, distance, focus}), radii);
    expect_radii(coc_of({1, 0.125f, 0}, {range, width, most, distance}), {-10, -5, 10});
}

// Range ends at which fp32 could compute 0 times infinity: the focus plane stays at 0. s -> f: the
// radius off the focus plane grows without bound and is clamped. What is no depth is sky.
TEST(coc_stage, extremes) {
    struct Case {
        std::vector<float> w;
        Settings settings;
        std::vector<double> radii;
    };
    const auto near_f = [](double beyond) { return 0.036 * (1 + beyond); };
    const std::vector<float> around = {0, 0.25f, 0.5f}, odd = {kNan, -1, -kInfinity, 0};
    const std::vector<double> clamped = {19.2, 0, -19.2}, above = {19.2, 19.2, 19.2, -19.2};
    const Case cases[] = {
        {around, {{"f_stop", 1e-300}}, clamped},
        {around, {{"sensor_width_mm", 1e-300}}, clamped},
        {around, {{"coc", "range"s}, {"range", 1e-300}}, clamped},
        {around, {{"coc", "range"s}, {"focus", 1e30}, {"range", 1e30}}, {19.2, -19.2, -19.2}},
        {{0, 0.25f, 1, 100}, {{"focus_distance", near_f(1e-3)}, {"breathing", true}}, above},
        {{0, 0.25f, 1, 100}, {{"focus_distance", near_f(1e-12)}, {"breathing", true}}, above},
        {odd, {}, {8, 8, 8, 8}},
        {odd, {{"coc", "planes"s}}, {3.2, 3.2, 3.2, 3.2}},
        {odd, {{"coc", "range"s}}, {19.2, 19.2, 19.2, 19.2}}};
    for (const Case& one : cases) {
        SCOPED_TRACE(&one - cases);
        expect_radii(coc_of(one.w, one.settings), one.radii);
    }
}

// ----------------------------------------------------------------------- configuration errors

// The key before the first colon of the message.
std::string key_of_error(Settings settings, const Camera& camera) {
    FrameDescription frame = describe_round(deep_planes(4, 4));
    frame.camera = camera;
    const auto plan = make_plan(chain_of("depth_of_field", settings), frame);
    if (plan.ok()) return "";
    EXPECT_EQ(plan.status().code(), StatusCode::chain);
    const std::string place = "passes[0].depth_of_field: ", message = plan.status().message();
    EXPECT_EQ(message.substr(0, place.size()), place);
    return message.substr(place.size(), message.find(':', place.size()) - place.size());
}

Camera with(std::optional<double> Camera::*member, std::optional<double> value) {
    Camera camera = round_camera();
    camera.*member = value;
    return camera;
}

TEST(coc_errors, name_the_value) {
    using Member = std::optional<double> Camera::*;
    const std::pair<const char*, Member> lens[] = {{"focal_length_mm", &Camera::focal_length_mm},
                                                   {"f_stop", &Camera::f_stop},
                                                   {"focus_distance", &Camera::focus_distance},
                                                   {"sensor_width_mm", &Camera::sensor_width_mm},
                                                   {"meters_per_unit", &Camera::meters_per_unit}};
    for (const auto& [key, member] : lens)
        for (const double bad : {0.0, -1.0, double(kNan)})
            EXPECT_EQ(key_of_error({}, with(member, bad)), key) << bad;
    for (const auto& [key, member] : std::span(lens).first(4))  // meters_per_unit has a default
        EXPECT_EQ(key_of_error({}, with(member, std::nullopt)), key);
    Camera empty = with(&Camera::f_stop, std::nullopt);
    empty.focus_distance = std::nullopt;
    EXPECT_EQ(key_of_error({}, empty), "f_stop, focus_distance") << "all in one message";
    EXPECT_EQ(key_of_error({{"f_stop", 2.0}}, empty), "focus_distance");
    EXPECT_EQ(key_of_error({{"coc", "range"s}}, empty), "focus");
    EXPECT_EQ(key_of_error({{"coc", "planes"s}}, {}), "") << "needs no lens";
    // Focus within the focal length of 36 mm.
    for (const double s : {0.036, 0.01})
        EXPECT_EQ(key_of_error({{"focus_distance", s}}, round_camera()), "focus_distance");
    Camera millimeters = with(&Camera::meters_per_unit, 1e-3);  // the lens is 36 units long
    millimeters.focus_distance = 36;
    EXPECT_EQ(key_of_error({}, millimeters), "focus_distance");
    const auto planes = [](double near_blurry, double near_sharp, double far_sharp) {
        return key_of_error({{"coc", "planes"s},
                             {"near_blurry", near_blurry},
                             {"near_sharp", near_sharp},
                             {"far_sharp", far_sharp},
                             {"far_blurry", 4.0}},
                            round_camera());
    };
    EXPECT_EQ(planes(2, 2, 3), "near_blurry");
    EXPECT_EQ(planes(1, 3, 2), "near_sharp");
    EXPECT_EQ(planes(1, 2, 4), "far_sharp");
}

TEST(coc_errors, a_place_whose_depth_is_not_known) {
    for (const auto& coc : {"lens"s, "range"s})
        EXPECT_EQ(key_of_error({{"focus_at", std::array{0.8, 0.5}}, {"coc", coc}}, round_camera()),
                  "focus_at");
}

TEST(coc_errors, two_shapes_of_one_aperture) {
    Camera camera = round_camera();
    camera.aperture_image = BokehKernel("picture.png");
    EXPECT_EQ(key_of_error({}, camera), "aperture_image") << "it was not read";
    EXPECT_EQ(key_of_error({{"aperture_blades", int64_t(7)}}, camera), "aperture_blades");
    EXPECT_EQ(key_of_error({{"aperture_curvature", 0.25}}, camera), "aperture_curvature");
    Camera blades = camera, curvature = camera;
    blades.aperture_blades = 7;
    curvature.aperture_curvature = 0.25;
    EXPECT_EQ(key_of_error({}, blades), "aperture_blades");
    EXPECT_EQ(key_of_error({}, curvature), "aperture_curvature");
    EXPECT_EQ(key_of_error({{"method", "gilham"s}}, blades), "") << "has no aperture";
}

// The largest auto kernel of a 16384 px wide display fits; a larger one is reported.
TEST(coc_errors, kernel_too_wide) {
    FrameDescription frame = describe_round(deep_planes(4, 4));
    const auto error = [&](int display_width) {
        frame.display_width = display_width;
        const auto plan = make_plan(
            chain_of("depth_of_field",
                     {{"method", "gilham"}, {"downsample", int64_t(1)}, {"coc", "range"s}}),
            frame);
        return plan.status().message();
    };
    EXPECT_EQ(error(16384), "");
    EXPECT_THAT(error(60000), HasSubstr("blur_sigma_px: 900 px (auto) at downsample 1 needs 2700"));
}

}  // namespace
}  // namespace postchain::test::coc_test
