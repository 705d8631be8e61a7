// Written files, and errors if they cannot be written.
#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <functional>
#include <map>

#include "config/camera_file.h"
#include "tests/scenes/support.h"
#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/image/bokeh_kernel_file.h"

namespace postchain::scenes::test {
namespace {

namespace fs = std::filesystem;
using postchain::test::must;

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
    void write() { ASSERT_EQ(postchain::test::error_of(write_scene(renderer(), request_)), ""); }
    CameraFile camera() const {
        CameraFile file = must(load_camera(at("camera.json")));
        EXPECT_TRUE(file.status().ok()) << file.status().message();
        return file;
    }
    std::vector<std::string> channels(const std::string& name) const {
        const io::ExrFile file = must(io::ExrFile::open(at(name)));
        std::vector<std::string> found;
        for (const auto& channel : file.parts().at(0).channels) found.push_back(channel.name);
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
    write();
    EXPECT_THAT(names(),
                testing::UnorderedElementsAre("gbuf.0003.exr", "sharp.0003.exr", "camera.json"));
    auto file = must(io::ExrFile::open(at("gbuf.0003.exr")));
    EXPECT_THAT(channels("gbuf.0003.exr"), testing::SizeIs(9));
    for (const auto& channel : file.parts().at(0).channels)
        EXPECT_EQ(channel.type, channel.name.starts_with("ViewLayer.Combined.")
                                    ? io::PixelType::half
                                    : io::PixelType::float32)
            << channel.name;
    const ScenePlanes planes = render("crossing", 48, 27, 3, Picture::gbuf);
    EXPECT_EQ(must(file.read_channels(0, {"ViewLayer.Depth.Z"})), planes.depth);
    EXPECT_EQ(must(file.read_channels(0, {"ViewLayer.Vector.X", "ViewLayer.Vector.Y",
                                          "ViewLayer.Vector.Z", "ViewLayer.Vector.W"})),
              planes.vectors);
    const ImageF color =
        must(file.read_channels(0, {"ViewLayer.Combined.R", "ViewLayer.Combined.A"}));
    for (int y = 0; y < 27; ++y)
        for (int x = 0; x < 48; ++x) {
            const float red = planes.color.at(x, y, 0);
            EXPECT_NEAR(color.at(x, y, 0), red, red / 2048 + 1e-7);  // half has 11 bits
            EXPECT_EQ(color.at(x, y, 1), planes.color.at(x, y, 3));
        }
}

TEST_F(Files, OfATruthHoldColorOnlyAndThoseOfTheLayerBehindAreWrittenIfAskedFor) {
    request_.truth_samples = 2;
    request_.behind = true;
    write();
    EXPECT_THAT(names(), testing::UnorderedElementsAre(
                             "gbuf.0001.exr", "sharp.0001.exr", "behind.0001.exr", "mb.0001.exr",
                             "dof.0001.exr", "both.0001.exr", "camera.json"));
    EXPECT_THAT(channels("both.0001.exr"), testing::UnorderedElementsAre("R", "G", "B", "A"));
    EXPECT_EQ(channels("behind.0001.exr"), channels("sharp.0001.exr"));
}

TEST_F(Files, OnlyTheTruthsThatAreAskedForAreWritten) {
    request_.truth_samples = 2;
    request_.truths = {Picture::both, Picture::dof};
    write();
    EXPECT_THAT(names(),
                testing::UnorderedElementsAre("gbuf.0001.exr", "sharp.0001.exr", "dof.0001.exr",
                                              "both.0001.exr", "camera.json"));
}

TEST_F(Files, AreTheSameBytesHoweverTheSequenceIsSplit) {
    request_.frames = {1, 2};
    request_.truth_samples = 20;  // not a multiple of a dispatch
    write();
    std::map<std::string, std::string> before;
    for (const char* name : {"gbuf.0002.exr", "sharp.0002.exr", "both.0002.exr"})
        before[name] = bytes(name);
    EXPECT_EQ(write_scene(renderer(), request_).code(), StatusCode::output);
    request_.frames = {2};
    request_.on_existing = io::OnExisting::overwrite;
    const auto other = must(SceneRenderer::create());
    ASSERT_EQ(postchain::test::error_of(write_scene(*other, request_)), "");
    for (const auto& [name, content] : before) EXPECT_EQ(bytes(name), content) << name;
}

TEST_F(Files, CameraIsReadBackAsItIs) {
    request_.frames = {4, 5};
    write();
    const CameraFile file = camera();
    EXPECT_EQ(file.camera_for(5, {48, 27}), camera_at(must(model_for(request_)), 4));
    EXPECT_DOUBLE_EQ(*file.camera.shutter_frames, 0.5);
    EXPECT_DOUBLE_EQ(*file.fps, 24);
    EXPECT_EQ(*file.resolution, (std::array{48, 27}));
}

TEST_F(Files, CameraOfAZoomHasItsValuesPerFrame) {
    request_.name = "zoom";
    request_.frames = {4, 5, -3};
    write();
    // 2.6 sin(2 pi 4 / 96) = 0.672929517 ahead; -z is ahead.
    EXPECT_EQ(
        io::Json::parse(bytes("camera.json"))["camera_matrix_world"]["4"],
        io::Json::parse("[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -0.672929517], [0, 0, 0, 1]]"));
    for (int frame : request_.frames) {
        const Camera read = camera().camera_for(frame, {48, 27});
        const Camera expected = camera_at(must(model_for(request_)), frame);
        EXPECT_NEAR(*read.focal_length_mm, *expected.focal_length_mm, 1e-6) << frame;
        EXPECT_NEAR(*read.focus_distance, *expected.focus_distance, 1e-7) << frame;
    }
}

TEST_F(Files, ThePictureOfTheApertureIsBesideTheCamera) {
    std::vector<float> values(BokehKernel::kSide * BokehKernel::kSide);
    for (size_t i = 0; i < values.size(); ++i) values[i] = float(i % 1009) / 3;
    request_.camera.aperture_image = *BokehKernel::make(values, "/elsewhere/a.png");
    request_.camera.aperture_rotation_deg = 20;
    write();
    CameraFile file = camera();
    EXPECT_EQ(file.camera.aperture_image.file(), at("aperture.exr"));
    io::ApertureFiles pictures;
    ASSERT_TRUE(pictures.read(file.camera).ok());
    EXPECT_EQ(file.camera, camera_at(must(model_for(request_)), 1));
    EXPECT_EQ(file.camera.aperture_image.values(), values);
    // Blades together with an aperture image are refused.
    request_.camera.aperture_blades = 5;
    EXPECT_EQ(model_for(request_).status().code(), StatusCode::usage);
}

TEST_F(Files, TheRequestsCameraReplacesTheScenes) {
    request_.camera.f_stop = 5.6;
    request_.camera.focus_distance = 2.5;
    request_.camera.shutter_frames = 0.25;
    const Camera camera = camera_at(must(model_for(request_)), 1);
    EXPECT_EQ((std::tuple{*camera.f_stop, *camera.focus_distance, *camera.shutter_frames,
                          *camera.focal_length_mm}),
              (std::tuple{5.6, 2.5, 0.25, 50.0}));
    for (const double f_stop : {0.0, double(NAN), HUGE_VAL}) {
        request_.camera.f_stop = f_stop;
        EXPECT_EQ(model_for(request_).status().code(), StatusCode::usage) << f_stop;
        EXPECT_THAT(model_for(request_).status().message(), testing::HasSubstr("camera.f_stop"));
    }
    request_.camera = {};
    request_.camera.meters_per_unit = 0.01;
    EXPECT_EQ(model_for(request_).status().code(), StatusCode::usage);
}

TEST_F(Files, ErrorsSayWhatIsWrong) {
    struct Row {
        StatusCode code;
        const char* said;
        std::function<void(SceneRequest&)> change;
    };
    const Row rows[] = {
        {StatusCode::usage, "weels", [](SceneRequest& made) { made.name = "weels"; }},
        {StatusCode::usage, "wheels, poles", [](SceneRequest& made) { made.name = "weels"; }},
        {StatusCode::usage, "", [](SceneRequest& made) { made.frames = {}; }},
        {StatusCode::usage, "", [](SceneRequest& made) { made.truth_samples = -1; }},
        {StatusCode::output, "missing", [](SceneRequest& made) { made.folder += "/missing"; }}};
    for (const Row& row : rows) {
        SceneRequest made = request_;
        row.change(made);
        const Status status = write_scene(renderer(), made);
        EXPECT_EQ(status.code(), row.code) << status.message();
        EXPECT_THAT(status.message(), testing::HasSubstr(row.said));
    }
    EXPECT_EQ(render_frame(renderer(), request_, 1, Picture::mb).status().code(),
              StatusCode::usage);
    EXPECT_FALSE(fs::exists(request_.folder)) << "an invalid request must create nothing";
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

}  // namespace
}  // namespace postchain::scenes::test
