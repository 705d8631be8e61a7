// Written files, and errors if they cannot be written.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>

#include "config/camera_file.h"
#include "tests/measure/scenes/support.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tools/measure/scenes/crossing.h"
#include "tools/measure/scenes/zoom.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/bokeh_kernel_file.h"

namespace postchain::scenes::test {
namespace {

namespace fs = std::filesystem;

class Files : public testing::Test {
  protected:
    void SetUp() override {
        request_.name = "crossing";
        request_.folder = folder_.path("made");
        request_.width = 48;
        request_.height = 27;
        request_.sharp_samples = 4;
    }

    std::string at(const std::string& name) const { return request_.folder + "/" + name; }
    std::vector<std::string> names() const {
        std::vector<std::string> found;
        for (const auto& entry : fs::directory_iterator(request_.folder))
            found.push_back(entry.path().filename().string());
        return found;
    }
    std::string bytes(const std::string& name) const {
        return postchain::test::read_text(at(name));
    }

    postchain::test::TempFolder folder_;
    SceneRequest request_;
};

TEST_F(Files, HoldTheCyclesChannels) {
    request_.frames = {3};
    ASSERT_TRUE(write_scene(renderer(), request_).ok());
    EXPECT_THAT(names(),
                testing::UnorderedElementsAre("gbuf.0003.exr", "sharp.0003.exr", "camera.json"));
    auto file = io::ExrFile::open(at("gbuf.0003.exr"));
    ASSERT_TRUE(file.ok()) << file.status().message();
    const io::ExrPart& part = file->parts().at(0);
    EXPECT_EQ(part.channels.size(), 9u);
    for (const char* name : {"R", "G", "B", "A"}) {
        const auto* channel = part.find(concat("ViewLayer.Combined.", name));
        ASSERT_NE(channel, nullptr);
        EXPECT_EQ(channel->type, io::PixelType::half);
    }
    for (const char* name : {"Depth.Z", "Vector.X", "Vector.Y", "Vector.Z", "Vector.W"}) {
        const auto* channel = part.find(concat("ViewLayer.", name));
        ASSERT_NE(channel, nullptr) << name;
        EXPECT_EQ(channel->type, io::PixelType::float32);
    }

    const ScenePlanes planes = render("crossing", 48, 27, 3, Picture::gbuf);
    auto depth = file->read_channels(0, {"ViewLayer.Depth.Z"});
    auto vectors = file->read_channels(0, {"ViewLayer.Vector.X", "ViewLayer.Vector.Y",
                                           "ViewLayer.Vector.Z", "ViewLayer.Vector.W"});
    auto color = file->read_channels(0, {"ViewLayer.Combined.R", "ViewLayer.Combined.A"});
    ASSERT_TRUE(depth.ok() && vectors.ok() && color.ok());
    EXPECT_EQ(*depth, planes.depth);
    EXPECT_EQ(*vectors, planes.vectors);
    for (int y = 0; y < 27; ++y)
        for (int x = 0; x < 48; ++x) {
            const float red = planes.color.at(x, y, 0);
            EXPECT_NEAR(color->at(x, y, 0), red, red / 2048 + 1e-7);  // half has 11 bits
            EXPECT_EQ(color->at(x, y, 1), planes.color.at(x, y, 3));
        }
}

TEST_F(Files, OfATruthHoldColorOnly) {
    request_.truth_samples = 2;
    ASSERT_TRUE(write_scene(renderer(), request_).ok());
    EXPECT_THAT(names(),
                testing::UnorderedElementsAre("gbuf.0001.exr", "sharp.0001.exr", "mb.0001.exr",
                                              "dof.0001.exr", "both.0001.exr", "camera.json"));
    auto file = io::ExrFile::open(at("both.0001.exr"));
    ASSERT_TRUE(file.ok());
    std::vector<std::string> channels;
    for (const auto& channel : file->parts().at(0).channels) channels.push_back(channel.name);
    EXPECT_THAT(channels, testing::UnorderedElementsAre("R", "G", "B", "A"));
}

TEST_F(Files, OfTheLayerBehindAreWrittenIfAskedFor) {
    request_.behind = true;
    ASSERT_TRUE(write_scene(renderer(), request_).ok());
    EXPECT_THAT(names(), testing::UnorderedElementsAre("gbuf.0001.exr", "sharp.0001.exr",
                                                       "behind.0001.exr", "camera.json"));
    auto file = io::ExrFile::open(at("behind.0001.exr"));
    auto sharp = io::ExrFile::open(at("sharp.0001.exr"));
    ASSERT_TRUE(file.ok() && sharp.ok());
    ASSERT_EQ(file->parts()[0].channels.size(), sharp->parts()[0].channels.size());
    for (const auto& channel : sharp->parts()[0].channels)
        EXPECT_NE(file->parts()[0].find(channel.name), nullptr) << channel.name;
}

TEST_F(Files, AreTheSameBytesHoweverTheSequenceIsSplit) {
    request_.frames = {1, 2};
    request_.truth_samples = 3;
    ASSERT_TRUE(write_scene(renderer(), request_).ok());
    const std::string sharp = bytes("sharp.0002.exr"), both = bytes("both.0002.exr");
    request_.frames = {2};
    request_.on_existing = io::OnExisting::overwrite;
    ASSERT_TRUE(write_scene(renderer(), request_).ok());
    EXPECT_GT(sharp.size(), 1000u);
    EXPECT_EQ(bytes("sharp.0002.exr"), sharp);
    EXPECT_EQ(bytes("both.0002.exr"), both);
}

TEST_F(Files, CameraIsReadBackAsItIs) {
    request_.frames = {4, 5};
    ASSERT_TRUE(write_scene(renderer(), request_).ok());
    auto camera = load_camera(at("camera.json"));
    ASSERT_TRUE(camera.ok()) << camera.status().message();
    ASSERT_TRUE(camera->status().ok()) << camera->status().message();
    const Camera expected = camera_at(make_crossing(), 4);
    EXPECT_EQ(camera->camera_for(5, {48, 27}), expected);
    EXPECT_DOUBLE_EQ(*expected.shutter_frames, 0.5);
    EXPECT_DOUBLE_EQ(*camera->fps, 24);
    EXPECT_EQ((*camera->resolution)[0], 48);
    EXPECT_EQ((*camera->resolution)[1], 27);
}

TEST_F(Files, CameraOfAZoomHasItsValuesPerFrame) {
    request_.name = "zoom";
    request_.frames = {4, 5, -3};
    ASSERT_TRUE(write_scene(renderer(), request_).ok());
    auto camera = load_camera(at("camera.json"));
    ASSERT_TRUE(camera.ok());
    ASSERT_TRUE(camera->status().ok()) << camera->status().message();
    // 2.6 sin(2 pi 4 / 96) = 0.672929517 ahead; -z is ahead.
    const auto json = io::Json::parse(bytes("camera.json"));
    EXPECT_EQ(
        json["camera_matrix_world"]["4"],
        io::Json::parse("[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -0.672929517], [0, 0, 0, 1]]"));
    const SceneModel model = make_zoom();
    for (int frame : request_.frames) {
        const Camera read = camera->camera_for(frame, {48, 27});
        const Camera expected = camera_at(model, frame);
        EXPECT_NEAR(*read.focal_length_mm, *expected.focal_length_mm, 1e-6) << frame;
        EXPECT_NEAR(*read.focus_distance, *expected.focus_distance, 1e-7) << frame;
    }
}

TEST_F(Files, ThePictureOfTheApertureIsBesideTheCamera) {
    std::vector<float> values(BokehKernel::kSide * BokehKernel::kSide);
    for (size_t i = 0; i < values.size(); ++i) values[i] = float(i % 1009) / 3;
    request_.camera.aperture_image = *BokehKernel::make(values, "/elsewhere/a.png");
    request_.camera.aperture_rotation_deg = 20;
    ASSERT_TRUE(write_scene(renderer(), request_).ok());
    auto camera = load_camera(at("camera.json"));
    ASSERT_TRUE(camera.ok() && camera->status().ok()) << camera->status().message();
    EXPECT_EQ(camera->camera.aperture_image.file(), at("aperture.exr"));
    io::ApertureFiles pictures;
    ASSERT_TRUE(pictures.read(camera->camera).ok());
    const auto model = model_for(request_);
    ASSERT_TRUE(model.ok());
    EXPECT_EQ(camera->camera, camera_at(*model, 1));
    EXPECT_EQ(camera->camera.aperture_image.values(), values);
    // Blades together with an aperture image are refused.
    request_.camera.aperture_blades = 5;
    EXPECT_EQ(model_for(request_).status().code(), StatusCode::usage);
    EXPECT_THAT(model_for(request_).status().message(),
                testing::HasSubstr("aperture_blades and aperture_image are both given"));
}

TEST_F(Files, TheRequestsCameraReplacesTheScenes) {
    request_.camera.f_stop = 5.6;
    request_.camera.focus_distance = 2.5;
    request_.camera.shutter_frames = 0.25;
    const auto model = model_for(request_);
    ASSERT_TRUE(model.ok());
    const Camera camera = camera_at(*model, 1);
    EXPECT_EQ(*camera.f_stop, 5.6);
    EXPECT_EQ(*camera.focus_distance, 2.5);
    EXPECT_EQ(*camera.shutter_frames, 0.25);
    EXPECT_EQ(*camera.focal_length_mm, 50);
    request_.camera.f_stop = 0;
    EXPECT_EQ(model_for(request_).status().code(), StatusCode::usage);
    EXPECT_THAT(model_for(request_).status().message(), testing::HasSubstr("camera.f_stop"));
    request_.camera.f_stop = NAN;
    EXPECT_EQ(model_for(request_).status().code(), StatusCode::usage);
    request_.camera = {};
    request_.camera.meters_per_unit = 0.01;
    EXPECT_EQ(model_for(request_).status().code(), StatusCode::usage);
}

TEST_F(Files, ErrorsSayWhatIsWrong) {
    request_.name = "weels";
    const Status unknown = write_scene(renderer(), request_);
    EXPECT_EQ(unknown.code(), StatusCode::usage);
    EXPECT_THAT(unknown.message(),
                testing::AllOf(testing::HasSubstr("weels"), testing::HasSubstr("wheels, poles")));
    request_.name = "still";
    request_.frames = {};
    EXPECT_EQ(write_scene(renderer(), request_).code(), StatusCode::usage);
    request_.frames = {1};
    request_.truth_samples = -1;
    EXPECT_EQ(write_scene(renderer(), request_).code(), StatusCode::usage);
    request_.truth_samples = 0;
    EXPECT_EQ(render_frame(renderer(), request_, 1, Picture::mb).status().code(),
              StatusCode::usage);
    EXPECT_FALSE(fs::exists(request_.folder)) << "an invalid request must create nothing";
    for (const auto& [f_stop, fault] :
         {std::pair{0.0, "0 is not above 0"}, {HUGE_VAL, "inf is not finite"}}) {
        request_.camera.f_stop = f_stop;
        EXPECT_THAT(write_scene(renderer(), request_).message(), testing::HasSubstr(fault));
    }
    request_.camera.f_stop.reset();
    request_.folder = folder_.path("parent/missing");
    const Status missing = write_scene(renderer(), request_);
    EXPECT_EQ(missing.code(), StatusCode::output);
    EXPECT_THAT(missing.message(), testing::HasSubstr(request_.folder));
}

TEST_F(Files, ProgressGrowsToOneAndCanStop) {
    request_.truth_samples = 20;
    request_.frames = {1, 2};
    double last = -1;
    const Status status = write_scene(renderer(), request_, [&](const SceneProgress& progress) {
        EXPECT_GE(progress.done, last);
        last = progress.done;
        return true;
    });
    ASSERT_TRUE(status.ok());
    EXPECT_NEAR(last, 1, 1e-9);

    fs::remove_all(request_.folder);
    const Status stopped = write_scene(renderer(), request_, [](const SceneProgress& progress) {
        return progress.picture != Picture::dof;
    });
    EXPECT_EQ(stopped.code(), StatusCode::canceled);
    EXPECT_THAT(names(),
                testing::UnorderedElementsAre("gbuf.0001.exr", "sharp.0001.exr", "mb.0001.exr"));
}

TEST_F(Files, AreKeptWhenAsked) {
    ASSERT_TRUE(write_scene(renderer(), request_).ok());
    request_.on_existing = io::OnExisting::fail;
    EXPECT_EQ(write_scene(renderer(), request_).code(), StatusCode::output);
    request_.on_existing = io::OnExisting::overwrite;
    EXPECT_TRUE(write_scene(renderer(), request_).ok());
}

}  // namespace
}  // namespace postchain::scenes::test
