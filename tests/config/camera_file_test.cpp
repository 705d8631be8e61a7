#include "config/camera_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "fake_passes.h"
#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"

namespace postchain {
namespace {

using test::must;
using test::texts;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr Display kHd = {1920, 1080, 1};

CameraFile parse(const std::string& text) {
    return parse_camera(text, "camera.json");
}
std::vector<std::string> messages_of(const std::string& text) {
    return texts(parse(text).diagnostics);
}
std::vector<std::string> places_of(const std::string& text) {
    return test::places(parse(text).diagnostics);
}
CameraFile parse_good(const std::string& text) {
    const CameraFile file = parse(text);
    EXPECT_THAT(texts(file.diagnostics), IsEmpty());
    return file;
}

TEST(CameraFile, ReadsEveryKey) {
    const CameraFile file = parse_good(R"({
        "resolution": [640, 360], "focal_length_mm": 50.0, "sensor_width_mm": 36,
        "f_stop": 1.399999976158142, "focus_distance": 1.3, "near_clip": 0.05, "far_clip": 60.0,
        "shutter_frames": 0.5, "fps": 24, "sensor_fit": "vertical", "meters_per_unit": 0.01,
        "frames": [10, 11, -3]})");
    Camera expected;
    expected.focal_length_mm = 50;
    expected.sensor_width_mm = 36;
    expected.f_stop = 1.399999976158142;
    expected.focus_distance = 1.3;
    expected.near_clip = 0.05;
    expected.far_clip = 60;
    expected.shutter_frames = 0.5;
    expected.meters_per_unit = 0.01;
    EXPECT_EQ(file.camera, expected);
    EXPECT_EQ(file.resolution, (std::array<int, 2>{640, 360}));
    EXPECT_EQ(file.fps, 24.0);
    EXPECT_EQ(file.sensor_fit, SensorFit::vertical);
    EXPECT_THAT(file.frames, IsEmpty());
    EXPECT_EQ(parse("{}").camera_for(1, kHd), Camera());
}

TEST(CameraFile, OverridesSingleFrames) {
    const CameraFile file = parse_good(R"({"f_stop": 2, "focus_distance": 5, "sensor_width_mm": 36,
        "frames": {"10": {"focus_distance": 4}, "-1": {"f_stop": 8, "sensor_width_mm": 24,
                   "sensor_fit": "vertical"}}})");
    EXPECT_EQ(file.camera_for(9, kHd).focus_distance, 5.0);
    EXPECT_EQ(file.camera_for(10, kHd).focus_distance, 4.0);
    EXPECT_EQ(file.camera_for(10, kHd).f_stop, 2.0);
    EXPECT_EQ(file.camera_for(-1, kHd).f_stop, 8.0);
    // 24 mm over the height of a 16:9 image: 24 * 16/9 = 42.67 mm over its width.
    EXPECT_NEAR(*file.camera_for(-1, kHd).sensor_width_mm, 42.0 + 2.0 / 3.0, 1e-12);
    EXPECT_EQ(*file.camera_for(0, kHd).sensor_width_mm, 36.0);
    // Without a value of its own a frame has the file's.
    const CameraFile high = parse_good(R"({"sensor_width_mm": 24, "sensor_fit": "vertical",
        "frames": {"10": {"focus_distance": 4}, "11": {"sensor_fit": "horizontal"}}})");
    for (const auto& [frame, width] :
         {std::pair(9, 42.0 + 2.0 / 3.0), {10, 42.0 + 2.0 / 3.0}, {11, 24.0}})
        EXPECT_NEAR(*high.camera_for(frame, kHd).sensor_width_mm, width, 1e-12) << frame;
}

TEST(CameraFile, TurnsTheSensorSizeIntoAWidth) {
    constexpr auto kWidth = SensorFit::horizontal, kHeight = SensorFit::vertical,
                   kLarger = SensorFit::larger_side;
    const std::tuple<SensorFit, Display, double> cases[] = {
        // Landscape 3:2, and portrait: 36 mm of height are 24 mm of width.
        {kWidth, {300, 200, 1}, 36},
        {kLarger, {300, 200, 1}, 36},
        {kHeight, {300, 200, 1}, 54},
        {kWidth, {200, 300, 1}, 36},
        {kLarger, {200, 300, 1}, 24},
        // Pixels twice as wide as high: 200x300 pixels are 400:300, so the width is larger.
        {kLarger, {200, 300, 2}, 36},
        {kHeight, {200, 300, 2}, 48},
        {kLarger, {100, 100, 1}, 36},
        // A display without an area, or pixels without a width.
        {kHeight, {200, 0, 1}, 36},
        {kHeight, {200, 300, 0}, 36}};
    for (const auto& [fit, display, width] : cases)
        EXPECT_EQ(horizontal_sensor_width_mm(36, fit, display), width) << display.width;
    const CameraFile file = parse(R"({"sensor_width_mm": 36, "sensor_fit": "auto"})");
    EXPECT_EQ(file.camera_for(1, {200, 300, 1}).sensor_width_mm, 24.0);
}

TEST(CameraFile, ReadsRotationsFromMatrices) {
    const CameraFile file = parse_good(R"({"camera_matrix_world": {
        "4": [[0, 0, 2, 7], [0, 2, 0, 8], [-2, 0, 0, 9], [0, 0, 0, 1]],
        "5": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
        "6": [[1, 0, 0, "x"], [0, 1, 0, 8], [0, 0, 1, 9]]}})");
    EXPECT_EQ(file.rotations.at(4), (Rotation{{{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}}}));
    for (const int frame : {5, 6})
        EXPECT_EQ(file.rotations.at(frame), (Rotation{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}));
    EXPECT_EQ(file.places, (std::map<int, std::array<double, 3>>{{4, {7, 8, 9}}}));
}

TEST(CameraFile, IgnoresWhatIsNoRotation) {
    for (const char* matrices :
         {"[1, 2]", R"({"x": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]})",
          R"({"4": [[1, 0, 0], [0, 1, 0]]})", R"({"4": [[1, 0, 0], [0, 1, 0], [0, 0, "a"]]})",
          R"({"4": [[1, 0, 0], [0, 1, 0], [0, 0, 0]]})",
          R"({"4": [[1, 1, 0], [0, 1, 0], [0, 0, 1]]})",
          R"({"4": [[1, 0, 1], [0, 1, 0], [0, 0, 1]]})",
          R"({"4": [[1, 0, 0], [0, 1, 1], [0, 0, 1]]})",
          // No list; a row that is none; longer than a double can say.
          R"({"4": 3})", R"({"4": [[1, 0, 0], 2, [0, 0, 1]]})",
          R"({"4": [[1e200, 0, 0], [0, 1, 0], [0, 0, 1]]})",
          // Transposed; projective; a word; five rows; five columns; a row that is shorter.
          R"({"4": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [7, 8, 9, 1]]})",
          R"({"4": [[1, 0, 0, 7], [0, 1, 0, 8], [0, 0, 1, 9], [0, 0, 1, 0]]})",
          R"({"4": [[1, 0, 0, 7], [0, 1, 0, 8], [0, 0, 1, 9], [0, 0, 0, "x"]]})",
          R"({"4": [[1, 0, 0, 7], [0, 1, 0, 8], [0, 0, 1, 9], [0, 0, 0, 1], [0, 0, 0, 1]]})",
          R"({"4": [[1, 0, 0, 7, 0], [0, 1, 0, 8, 0], [0, 0, 1, 9, 0]]})",
          R"({"4": [[1, 0, 0, 7], [0, 1, 0], [0, 0, 1, 9]]})"}) {
        const CameraFile file =
            parse(concat("{\"f_stop\": 2, \"camera_matrix_world\": ", matrices, "}"));
        EXPECT_TRUE(file.status().ok());
        EXPECT_TRUE(file.rotations.empty()) << matrices;
        EXPECT_THAT(texts(file.diagnostics), ElementsAre(HasSubstr("camera_matrix_world: ignored")))
            << matrices;
    }
}

TEST(CameraFile, IgnoresUnknownKeysWithANoteOrAWarning) {
    const CameraFile file = parse(
        "{\n \"scene\": \"s1\",\n \"f_stop\": 2,\n \"matrix\": {\"9\": [[1.0, NaN], [0, 1]]},\n"
        " \"frames\": {\"3\": {\"lens_file\": \"x\"}, \"4\": {\"lens_file\": \"y\"}}\n}\n");
    EXPECT_THAT(texts(file.diagnostics),
                ElementsAre("camera.json:2:2: note: ignored keys: scene, matrix, lens_file"));
    EXPECT_TRUE(file.status().ok());
    EXPECT_EQ(file.camera.f_stop, 2.0);
    EXPECT_THAT(
        messages_of(R"({"f_stop": 2, "frames": {"2": {"resolution": [64, 48]}}})"),
        ElementsAre(HasSubstr("warning: frames.2.resolution: ignored: belongs at the top")));
    // Misspelt, or in another form.
    for (const auto& [given, known] : {std::pair("focal_lenght_mm", "focal_length_mm"),
                                       {"shutterFrames", "shutter_frames"},
                                       {"F_Stop", "f_stop"},
                                       {"FOCAL_LENGTH", "focal_length_mm"},
                                       {"focalLength", "focal_length_mm"},
                                       {"sensor_width_cm", "sensor_width_mm"},
                                       {"focusDistanceM", "focus_distance"},
                                       {"shutterAngle", "shutter_angle_deg"},
                                       {"camera-matrix-world", "camera_matrix_world"}})
        EXPECT_THAT(messages_of(concat("{\"", given, "\": 1, \"cats_eye\": 0.5}")),
                    ElementsAre(HasSubstr(concat("did you mean '", known, "'?"))));
    // Other programs' keys.
    for (const char* key : {"lens", "z", "fov", "near_plane"})
        EXPECT_THAT(messages_of(concat("{\"", key, "\": 1, \"f_stop\": 2}")),
                    ElementsAre(HasSubstr(concat("note: ignored keys: ", key))));
    std::string many;
    for (int i = 1; i <= 22; ++i) many += concat(", \"", i, "\": 0");
    EXPECT_THAT(messages_of("{\"f_stop\": 2" + many + "}"),
                ElementsAre(testing::EndsWith("18, 19, 20 and 2 more")));
    // No camera value at all.
    EXPECT_THAT(messages_of("{}"),
                ElementsAre(HasSubstr("warning: no camera value in this file; known are focal_")));
    EXPECT_THAT(places_of(R"({"fps": 24, "scene": 1})"), ElementsAre("1:1 warning ", "1:13 note "));
    EXPECT_THAT(places_of(R"({"frames": {"3": {"f_stop": 2}}})"), IsEmpty());
}

TEST(CameraFile, TakesThePositionOfTheShutter) {
    for (const auto& [word, position] : {std::pair("start", ShutterPosition::start),
                                         {"END", ShutterPosition::end},
                                         {"Start on Frame", ShutterPosition::start},
                                         {"centre on frame", ShutterPosition::center},
                                         {"Centered", ShutterPosition::center},
                                         {"centred", ShutterPosition::center},
                                         {"CENTER", ShutterPosition::center}}) {
        const CameraFile file =
            parse_good(concat("{\"f_stop\": 2,\n \"shutter_position\": \"", word, "\"}"));
        EXPECT_EQ(file.camera.shutter_position, position) << word;
        EXPECT_EQ(file.origins.at("shutter_position").where, "camera.json:2");
    }
    EXPECT_THAT(messages_of(R"({"shutter_position": ["start"]})"),
                ElementsAre(HasSubstr("a list; shutter_pos")));
    EXPECT_THAT(messages_of(R"({"shutter_position": "middle"})"),
                ElementsAre(HasSubstr("shutter_position is one of start, center, end")));
}

// Keys that change the picture and that no pass supports, unless their value changes nothing.
TEST(CameraFile, WarnsOfWhatIsNotSupported) {
    for (const char* text :
         {"\"shutter_offset\": 0.25", "\"shutter_curve\": [0, 1, 0]", "\"rolling_shutter\": true",
          "\"rolling_shutter_type\": \"TOP\"", "\"rolling_shutter\": {\"rows\": 9}",
          "\"shift_x\": 0.1", "\"lens_shift\": [0, 0.1]"})
        EXPECT_THAT(messages_of(concat("{\"f_stop\": 2, ", text, "}")),
                    ElementsAre(AllOf(HasSubstr("warning: "), HasSubstr(" is not supported: "))))
            << text;
    for (const char* text :
         {"\"shutter_offset\": 0", "\"rolling_shutter\": false",
          "\"rolling_shutter_type\": \"NONE\"", "\"lens_shift\": [0, 0]", "\"rolling_shutter\": {}",
          "\"shift_x\": null", "\"shutter_curve\": \"none\""})
        EXPECT_THAT(messages_of(concat("{\"f_stop\": 2, ", text, "}")), IsEmpty()) << text;
    EXPECT_THAT(messages_of(R"({"f_stop": 2, "frames": {"3": {"shift_y": 0.1}}})"),
                ElementsAre(HasSubstr("warning: frames.3.shift_y: ignored: shift_y is not")));
}

TEST(CameraFile, TakesTheShutterAsAnAngle) {
    const CameraFile file = parse_good(
        "{\"shutter_angle_deg\": 180,\n \"frames\": {\"3\": {\"shutter_angle_deg\": 90}}}");
    EXPECT_EQ(file.camera_for(1, kHd).shutter_frames, 0.5);
    EXPECT_EQ(file.camera_for(3, kHd).shutter_frames, 0.25);
    EXPECT_EQ(file.origins_for(3).at("shutter_frames").where, "camera.json:2");
    EXPECT_THAT(messages_of("{\"shutter_angle_deg\": -180}"),
                ElementsAre(HasSubstr("-180 degrees are -0.5 frames: -0.5 is out of range")));
}

// A value that is not given is another's: it has no place in this file.
TEST(CameraFile, NullIsNoValue) {
    const CameraFile file = parse_good(
        "{\"f_stop\": 2, \"near_clip\": null,\n \"frames\": {\"3\": {\"f_stop\": null}}}");
    EXPECT_EQ(file.camera_for(3, kHd).f_stop, 2.0);
    EXPECT_EQ(file.origins_for(3), (Origins{{"f_stop", {kFromCameraFile, "camera.json:1"}}}));
}

TEST(CameraFile, PlacesBadValues) {
    EXPECT_THAT(places_of("{\"f_stop\": 0,\n \"focus_distance\": \"4\", \"fps\": 0}"),
                ElementsAre("1:12 error f_stop", "2:20 error focus_distance", "2:32 error fps"));
    EXPECT_THAT(places_of(R"({"f_stop": 2,
 "frames": {"3": {"aperture_curvature": 0.5, "aperture_image": "a.png"}}})"),
                ElementsAre("2:18 error frames.3"));
    for (const char* bad : {R"({"resolution": [640]})",
                            R"({"resolution": [640, 0]})",
                            R"({"resolution": "640x360"})",
                            R"({"resolution": [640.5, 360]})",
                            R"({"sensor_fit": "both"})",
                            R"({"sensor_fit": 1})",
                            R"({"focal_length_mm": NaN})",
                            R"({"far_clip": Infinity})",
                            R"({"near_clip": [1]})",
                            R"({"shutter_frames": -0.5})",
                            R"({"shutter_angle_deg": "wide"})",
                            R"({"shutter_frames": 0.5, "shutter_angle_deg": 180})",
                            R"({"fps": "24"})",
                            R"({"frames": 10})",
                            R"({"frames": [1.5]})",
                            R"({"frames": {"x": {}}})",
                            R"({"frames": {"1": 2}})",
                            R"({"frames": {"1": {"f_stop": 0}}})",
                            R"({"frames": {"1": {}, "+1": {}}})",
                            R"({"frames": {"99999999999": {}}})",
                            R"({"f_stop": 2, "f_stop": 3})",
                            R"({"aperture_image": 3})",
                            R"({"aperture_image": "a.png", "aperture_blades": 6})",
                            R"([1])",
                            "",
                            R"({"f_stop": 2)"}) {
        const CameraFile file = parse(bad);
        EXPECT_THAT(texts(file.diagnostics), SizeIs(1)) << bad;
        EXPECT_EQ(file.status().code(), StatusCode::input) << bad;
    }
}

TEST(CameraFile, WarnsWhenTheResolutionIsAnother) {
    const CameraFile file = parse(R"({"resolution": [640, 360]})");
    EXPECT_FALSE(file.check_resolution({640, 360, 1}));
    EXPECT_THAT(file.check_resolution(kHd)->text(),
                HasSubstr("warning: resolution: 640x360 is not the display size 1920x1080"));
    EXPECT_FALSE(parse("{}").check_resolution(kHd));
}

TEST(CameraFile, IsReadFromDisk) {
    const test::TempFolder folder;
    test::write_text(folder.path("camera.json"), R"({"f_stop": 2.8})");
    EXPECT_EQ(must(load_camera(folder.path("camera.json"))).camera.f_stop, 2.8);
    EXPECT_EQ(load_camera(folder.path("none.json")).status().code(), StatusCode::input);
    EXPECT_EQ(load_camera("/").status().code(), StatusCode::input);
}

// The path of an aperture image starts at the folder of the camera file.
TEST(CameraFile, NamesThePictureOfTheAperture) {
    const std::string text =
        R"({"aperture_image": "pictures/a.png", "frames": {"3": {"aperture_image": "/b.png"}}})";
    const CameraFile file = parse_camera(text, "/shot/one/camera.json");
    EXPECT_EQ(file.camera.aperture_image, BokehKernel("/shot/one/pictures/a.png"));
    EXPECT_EQ(file.camera_for(3, kHd).aperture_image, BokehKernel("/b.png"));
    EXPECT_EQ(file.camera_for(4, kHd).aperture_image, file.camera.aperture_image);
    EXPECT_EQ(parse_camera(text, "camera.json").camera.aperture_image.file(),
              (std::filesystem::current_path() / "pictures/a.png").string());
    // A frame's values replace the file's.
    const CameraFile blades =
        parse_good(R"({"aperture_image": "a.png", "frames": {"3": {"aperture_blades": 6}}})");
    EXPECT_FALSE(blades.camera_for(3, kHd).aperture_image);
}

}  // namespace
}  // namespace postchain
