// The camera in a file's metadata: names, units, traps, matrices. Expected values are computed here
// from the documents that the table names.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/sequence/planes/camera_metadata.h"

namespace postchain::io::test_camera_metadata {
namespace {

using testing::HasSubstr;

CameraMetadata read(std::map<std::string, std::string> attributes) {
    ExrPart part;
    part.attributes = std::move(attributes);
    return camera_metadata(part);
}

const FoundAttribute* named(const CameraMetadata& metadata, const std::string& name) {
    for (const auto& one : metadata.found)
        if (one.row->name == name) return &one;
    return nullptr;
}

TEST(CameraMetadata, ShutterNeedsTheRateOfTheCamera) {
    EXPECT_FALSE(read({{"expTime", "0.02"}}).camera.shutter_frames);
    EXPECT_NEAR(*read({{"expTime", "0.02"}, {"framesPerSecond", "25/1"}}).camera.shutter_frames,
                0.5, 1e-12);
    // Slow motion: taken at 100, played at 25.
    const auto slow =
        read({{"expTime", "0.005"}, {"framesPerSecond", "25/1"}, {"captureRate", "100/1"}});
    EXPECT_NEAR(*slow.camera.shutter_frames, 0.5, 1e-12);
    EXPECT_EQ(slow.origins.at("shutter_frames").where, "expTime, captureRate");
    EXPECT_EQ(named(slow, "framesPerSecond")->gives, "");
    EXPECT_NEAR(*read({{"shutterAngle", "90"}, {"expTime", "1"}, {"captureRate", "24"}})
                     .camera.shutter_frames,
                0.25, 1e-12);
    EXPECT_FALSE(read({{"expTime", "inf"}, {"framesPerSecond", "24/1"}}).camera.shutter_frames);
    EXPECT_FALSE(read({{"expTime", "0.02"}, {"framesPerSecond", "24/x"}}).camera.shutter_frames);
}

TEST(CameraMetadata, UnitsOfLensAndSensor) {
    const auto own = read({{"pinholeFocalLength", "35"},
                           {"effectiveFocalLength", "36"},
                           {"aperture", "2.8"},
                           {"tStop", "3.1"},
                           {"focus", "4"},
                           {"sensorOverallDimensions", "28.25 18.17"},
                           {"sensorPhotositePitch", "8.25"},
                           {"sensorAcquisitionRectangle", "(0, 0)-(2879, 1619)"}});
    EXPECT_EQ(own.camera.focal_length_mm, 35);
    EXPECT_EQ(own.camera.f_stop, 2.8);
    EXPECT_EQ(own.camera.metadata_focus_m, 4);
    // The used part of the sensor: 2880 photosites of 8.25 micrometers.
    EXPECT_NEAR(*own.camera.sensor_width_mm, 23.76, 1e-12);
    EXPECT_EQ(own.origins.at("focal_length_mm"), (Origin{"metadata", "pinholeFocalLength"}));
    EXPECT_THAT(named(own, "effectiveFocalLength")->why, HasSubstr("pinholeFocalLength counts"));
    EXPECT_THAT(named(own, "tStop")->why, HasSubstr("not the f-number"));
    const auto overall =
        read({{"sensorOverallDimensions", "28.25 18.17"}, {"sensorPhotositePitch", "8.25"}});
    EXPECT_EQ(overall.camera.sensor_width_mm, 28.25);
    EXPECT_EQ(named(own, "sensorPhotositePitch")->gives,
              "sensor_width_mm, with sensorAcquisitionRectangle");
    EXPECT_EQ(named(overall, "sensorPhotositePitch")->gives, "");
    for (const char* bad : {"0", "-3", "nan", "fast", ""})
        EXPECT_FALSE(read({{"aperture", bad}}).camera.f_stop) << bad;
    EXPECT_EQ(read({{"Lens", "85.00"}}).camera.focal_length_mm, 85);
    EXPECT_FALSE(read({{"Lens", "<none>"}}).camera.focal_length_mm);
}

// A published header: 51.9469 mm, 26.9862 degrees, film of 24.9294 mm.
TEST(CameraMetadata, VRay) {
    const auto vray = read({{"cameraFocalLength", "51.9469"},
                            {"cameraFov", "26.9862"},
                            {"cameraAperture", "40"},
                            {"cameraFNumber", "8"},
                            {"cameraNearClip", "0"},
                            {"cameraFarClip", "1e+30"},
                            {"cameraTargetDistance", "508"}});
    EXPECT_NEAR(*vray.camera.sensor_width_mm, 24.9294, 1e-3);
    EXPECT_EQ(vray.camera.f_stop, 8);
    EXPECT_FALSE(vray.camera.near_clip);
    EXPECT_FALSE(vray.camera.far_clip);
    EXPECT_EQ(read({{"cameraFarClip", "100"}}).camera.far_clip, 100);
    EXPECT_FALSE(vray.camera.focus_distance);  // a target is not a focus distance
    EXPECT_EQ(read({{"cameraAperture", "36"}, {"cameraFov", "60"}}).camera.sensor_width_mm, 36);
}

using Matrix4 = std::array<std::array<double, 4>, 4>;  // rows

std::string text_of(const Matrix4& m) {
    std::string text;
    for (const auto& row : m)
        for (double v : row) text += std::to_string(v) + " ";
    text.pop_back();
    return text;
}

// A camera at (1, 2, 3) that is turned by 30 degrees to the left, about y: it looks along
// (-1/2, 0, -sqrt(3)/2), and its right is (sqrt(3)/2, 0, -1/2).
constexpr double kS = 0.8660254037844386;
void expect_pose(const CameraMetadata& metadata) {
    ASSERT_TRUE(metadata.pose);
    const auto& r = metadata.pose->to_world;
    const double right[3] = {kS, 0, -0.5}, up[3] = {0, 1, 0}, back[3] = {0.5, 0, kS};
    for (size_t k = 0; k < 3; ++k) {
        EXPECT_NEAR(r[k][0], right[k], 1e-5);
        EXPECT_NEAR(r[k][1], up[k], 1e-5);
        EXPECT_NEAR(r[k][2], back[k], 1e-5);
        EXPECT_NEAR(metadata.pose->position[k], double(k + 1), 1e-5);
    }
}

TEST(CameraMetadata, OneCameraInEveryConvention) {
    // Row vectors, +z ahead: the columns are right, up and ahead, the last row the world's origin.
    const double ahead[3] = {-0.5, 0, -kS};
    const Matrix4 standard = {{{kS, 0, ahead[0], 0},
                               {0, 1, ahead[1], 0},
                               {-0.5, 0, ahead[2], 0},
                               {-(kS - 1.5), -2, 0.5 + 3 * kS, 1}}};
    expect_pose(read({{"worldToCamera", text_of(standard)}}));
    const Matrix4 nuke = {{{kS, 0, 0.5, 1}, {0, 1, 0, 2}, {-0.5, 0, kS, 3}, {0, 0, 0, 1}}};
    std::string quoted = "[" + text_of(nuke) + "]";
    for (char& c : quoted)
        if (c == ' ') c = ',';
    expect_pose(read({{"nuke/camera/matrix", quoted}}));
    expect_pose(read({{"cameraTransform", text_of(nuke)}}));
    expect_pose(read({{"cameraTransform", text_of(nuke)},
                      {"vrayInfo/vrayversion", "Version of V-Ray for 3ds Max 3.60"}}));
    Matrix4 rows;
    for (size_t i = 0; i < 4; ++i)
        for (size_t j = 0; j < 4; ++j) rows[i][j] = nuke[j][i];
    expect_pose(read({{"cameraTransform", text_of(rows)}}));
    // Maya: columns right, back, down.
    const Matrix4 maya = {{{kS, 0.5, 0, 1}, {0, 0, -1, 2}, {-0.5, kS, 0, 3}, {0, 0, 0, 1}}};
    expect_pose(read({{"cameraTransform", text_of(maya)},
                      {"vrayInfo/vrayversion", "Version of V-Ray for Maya 3.60.02"}}));
}

TEST(CameraMetadata, FocalLengthOfWorldToNdc) {
    // A camera at the origin that looks along +z: x' = f/width x/z, from 0..1 or from -1..1.
    const Matrix4 camera = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}};
    const double f = 50.0 / 36;
    const Matrix4 documented = {{{f, 0, 0, 0}, {0, -f, 0, 0}, {0.5, 0.5, 1, 1}, {0, 0, -1, 0}}};
    const Matrix4 centered = {{{2 * f, 0, 0, 0}, {0, 2 * f, 0, 0}, {0, 0, 1, 1}, {0, 0, -1, 0}}};
    const Matrix4 shifted = {{{f, 0, 0, 0}, {0, -f, 0, 0}, {0.7, 0.5, 1, 1}, {0, 0, -1, 0}}};
    const Matrix4 raised = {{{f, 0, 0, 0}, {0, -f, 0, 0}, {0.5, 0.7, 1, 1}, {0, 0, -1, 0}}};
    for (const Matrix4& screen : {documented, centered}) {
        const auto metadata = read({{"worldToCamera", text_of(camera)},
                                    {"worldToNDC", text_of(screen)},
                                    {"pinholeFocalLength", "50"}});
        ASSERT_TRUE(metadata.pose && metadata.pose->focal_widths);
        EXPECT_NEAR(*metadata.pose->focal_widths, f, 1e-5);
        EXPECT_NEAR(*metadata.camera.sensor_width_mm, 36, 1e-3);
    }
    for (const Matrix4& screen : {shifted, raised}) {
        const auto metadata =
            read({{"worldToCamera", text_of(camera)}, {"worldToNDC", text_of(screen)}});
        EXPECT_FALSE(metadata.pose->focal_widths);
        EXPECT_THAT(named(metadata, "worldToNDC")->why, HasSubstr("shifted"));
    }
    // A sensor follows from a focal length, and a stated one stays.
    for (const auto& [key, value, sensor] :
         {std::tuple("Lens", "<none>", std::optional<double>()), {"cameraAperture", "40", 40.0}}) {
        const auto metadata = read({{"worldToCamera", text_of(camera)},
                                    {"worldToNDC", text_of(documented)},
                                    {"pinholeFocalLength", sensor ? "50" : "none"},
                                    {key, value}});
        EXPECT_TRUE(metadata.pose->focal_widths);
        EXPECT_EQ(metadata.camera.sensor_width_mm, sensor);
    }
}

TEST(CameraMetadata, BadMatricesAreNotUsed) {
    const std::pair<const char*, const char*> cases[] = {
        {"1 0 0 0 0 1 0 0 0 0 0 0 0 0 0 1", "singular"},
        {"1 0 0 0 0 1 0 0 0 0 nan 0 0 0 0 1", "not finite"},
        {"1 0 0 0 0 1 0 0 0 0 1 0 0 0", "not 16 numbers"},
        {"1 0 0 0 0 1 0 0 0 0 1 1 0 0 0 1", "not an affine"},
        {"1 0 0 0 0 1 0 1 0 0 1 0 0 0 0 1", "not an affine"},
        {"1e-310 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "singular"},
        {"1e-200 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "singular"},
        {"1 0 0 0 0 1 0 0 0.5 0 1 0 0 0 0 1", "right angles"},
        {"1 0 0 0 0 1 0 0 0 0.5 1 0 0 0 0 1", "right angles"},
        {"1 0 0 0 0.5 1 0 0 0 0 1 0 0 0 0 1", "right angles"},
        {"left", "not 16 numbers"}};
    for (const auto& [text, why] : cases) {
        const auto metadata = read({{"worldToCamera", text}});
        EXPECT_FALSE(metadata.pose) << text;
        EXPECT_THAT(named(metadata, "worldToCamera")->why, HasSubstr(why)) << text;
    }
}

TEST(CameraMetadata, SaysWhyAnAttributeIsNotUsed) {
    const std::string unit = "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1";
    const struct {
        std::map<std::string, std::string> attributes;
        std::string name, why;
    } cases[] = {
        {{{"cameraFov", "60"}}, "cameraFov", "no focal length is known"},
        {{{"cameraFocalLength", "50"}, {"cameraFov", "180"}}, "cameraFov", "not an angle"},
        {{{"expTime", "0.02"}}, "expTime", "neither captureRate nor framesPerSecond"},
        {{{"sensorAcquisitionRectangle", "(0, 0)-(2879, 1619)"}},
         "sensorAcquisitionRectangle",
         "sensorPhotositePitch is missing"},
        {{{"sensorAcquisitionRectangle", "(9, 0)-(5, 7)"}, {"sensorPhotositePitch", "8"}},
         "sensorAcquisitionRectangle",
         "not a rectangle"},
        {{{"sensorAcquisitionRectangle", "left"}, {"sensorPhotositePitch", "8"}},
         "sensorAcquisitionRectangle",
         "not a rectangle"},
        {{{"sensorAcquisitionRectangle", "(9, 0)"}, {"sensorPhotositePitch", "8"}},
         "sensorAcquisitionRectangle",
         "not a rectangle"},
        // A last row and a last column that are not zero.
        {{{"cameraTransform", "1 0 0 2 0 1 0 0 0 0 1 0 3 0 0 1"}},
         "cameraTransform",
         "not an affine matrix"},
        {{{"cameraTransform", "0 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1"}}, "cameraTransform", "singular"},
        {{{"worldToCamera", unit}, {"cameraTransform", unit}},
         "cameraTransform",
         "another matrix counts"},
        {{{"worldToNDC", unit}}, "worldToNDC", "worldToCamera is missing"},
        {{{"worldToCamera", unit}, {"worldToNDC", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 0"}},
         "worldToNDC",
         "no perspective"},
        {{{"worldToCamera", unit}, {"worldToNDC", "left"}}, "worldToNDC", "not 16 numbers"},
        // Places to the right are beside the camera.
        {{{"worldToCamera", unit}, {"worldToNDC", "1 0 0 -1 0 1 0 0 0 0 1 1 0 0 -1 0"}},
         "worldToNDC",
         "no perspective"},
        // The image position of what is to the right is to the left.
        {{{"worldToCamera", unit}, {"worldToNDC", "-1 0 0 0 0 1 0 0 0 0 1 1 0 0 -1 0"}},
         "worldToNDC",
         "no perspective"}};
    for (const auto& [attributes, name, why] : cases) {
        const auto metadata = read(attributes);
        ASSERT_TRUE(named(metadata, name)) << name;
        EXPECT_EQ(named(metadata, name)->gives, "") << name;
        EXPECT_THAT(named(metadata, name)->why, HasSubstr(why)) << name;
    }
}

}  // namespace
}  // namespace postchain::io::test_camera_metadata
