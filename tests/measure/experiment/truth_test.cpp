// Checks of a ground truth before anything is run, and report folders.
#include "tools/measure/experiment/experiment_input.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <future>
#include <limits>

#include "tests/measure/experiment/support.h"
#include "tests/support/images.h"
#include "tests/support/status.h"
#include "tests/support/text_file.h"
#include "tools/measure/experiment/report_folder.h"
#include "tools/scenes/renderer.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/exr/planes_writer.h"

namespace postchain::experiment {

using namespace report;
namespace {

using ::testing::HasSubstr;

class TruthFiles : public ::testing::Test {
  protected:
    void SetUp() override { test::write_sequence(folder_.path(), 3); }
    ExperimentSettings settings() const {
        return test::settings_for(folder_.path(), folder_.path("report"));
    }
    Result<Truth> truth() const {
        auto truth = Truth::open(settings().truth, {1, 2, 3});
        if (!truth.ok()) return truth.status();
        if (Status status = truth->survey(settings().run, metrics::ToneMapper::aces); !status.ok())
            return status;
        return truth;
    }
    void expect_refused(const std::string& words) {
        const Status status = truth().status();
        EXPECT_EQ(status.code(), StatusCode::input);
        EXPECT_THAT(status.message(), HasSubstr(words));
        EXPECT_THAT(status.message(), HasSubstr("truth.000"));  // the file is named
    }
    test::TempFolder folder_;
};

TEST_F(TruthFiles, APartOfTheFramesIsTakenAndNoneIsRefused) {
    expect_refused("has no file for any of the 3 frames of the input: 1-3");
    test::write_truth(folder_.path(), 2, 1, 0.1f);
    const Truth part = test::must(truth());
    EXPECT_EQ(part.frames(), std::vector<int>{2});
    EXPECT_TRUE(part.has(2) && !part.has(1) && !part.has(3));
    EXPECT_EQ(Truth::open(folder_.path("in.0001.exr"), {1, 2}).status().code(), StatusCode::usage);
}

TEST(Truth, IsOnePatternThatNamesAFileForEachFrame) {
    const auto said = [](const char* pattern, const std::vector<int>& frames) {
        const auto truth = Truth::open(pattern, frames);
        EXPECT_EQ(truth.status().code(), StatusCode::usage) << pattern;
        return test::error_of(truth);
    };
    EXPECT_THAT(said("color=a.####.exr,depth=b.####.exr", {1}), HasSubstr("give one pattern"));
    EXPECT_THAT(said("a.##.##.exr", {1}), HasSubstr("{truth}: "_keyed));
    EXPECT_THAT(said("a.exr", {1, 2}), HasSubstr("a.exr: one file for 2 frames"));
    EXPECT_EQ(Truth::open("a.exr", {1}).status().code(), StatusCode::input);  // it does not exist
}

TEST_F(TruthFiles, AnotherSizeNamesBoth) {
    test::write_truth(folder_.path(), 1, 3, 0.1f);
    test::write_truth(folder_.path(), 3, 1, 0.1f, 41);
    expect_refused("64x41");
    EXPECT_THAT(test::error_of(truth()), HasSubstr("in.0003.exr is 64x40"));
}

TEST_F(TruthFiles, FramesOfTheInputHaveOneSizeAndOneRangeOfExposures) {
    const auto survey = [&](int width, int height) {
        for (const auto& [frame, gray] : {std::pair(1, 2.0f), {2, 0.5f}, {3, 8.0f}}) {
            const bool odd = frame == 2;
            test::write_rgb(folder_.path(concat("in.000", frame, ".exr")),
                            ImageF(odd ? width : 64, odd ? height : 40, 3, gray));
        }
        return survey_input(settings().run, metrics::ToneMapper::reinhard, true);
    };
    for (const auto& [width, height] : {std::pair(65, 40), {64, 41}})
        EXPECT_THAT(test::error_of(survey(width, height)),
                    HasSubstr(concat("in.0002.exr: size is ", width, "x", height)));
    const InputSurvey whole = test::must(survey(64, 40));
    EXPECT_EQ(whole.frames, (std::vector<int>{1, 2, 3}));
    EXPECT_EQ(whole.width, 64);
    EXPECT_EQ(whole.height, 40);
    // x / (1 + x) = 0.85
    EXPECT_NEAR(whole.exposures.start, std::log2(0.85 / 0.15 / 8), 1e-6);
    EXPECT_NEAR(whole.exposures.stop, std::log2(0.85 / 0.15 / 0.5), 1e-6);
}

// Row 3 changes most in one pixel, row 7 in sum; there the pixels from 560 on change twice as much.
TEST_F(TruthFiles, TheSliceIsWhereItChangesMost) {
    for (int frame = 1; frame <= 3; ++frame) {
        const ImageF gray = test::make_image(600, 12, 3, [&](int x, int y, int) {
            if (frame != 2) return 0.5;
            return y == 3 && x == 9 ? 0.9 : y == 7 ? 0.5 + (x < 560 ? 0.05 : 0.1) : 0.5;
        });
        for (const char* name : {"in", "truth"})
            test::write_rgb(folder_.path(concat(name, ".000", frame, ".exr")), gray);
    }
    const Slice slice = test::must(truth()).slice().value();
    EXPECT_EQ(slice.row, 7);
    EXPECT_EQ(slice.left, 600 - 512);
    EXPECT_EQ(slice.width, 512);
    std::filesystem::remove(folder_.path("truth.0001.exr"));
    std::filesystem::remove(folder_.path("truth.0003.exr"));
    EXPECT_FALSE(test::must(truth()).slice());
}

Status write_cropped(const std::string& path, const ImageF& whole, const io::Window& data) {
    const io::Window display = {0, 0, 63, 39};
    const ImageF stored = io::placed(whole, display, data);
    io::PlanesFile file;
    for (int c = 0; c < 3; ++c)
        file.channels.push_back({std::string(1, "RGB"[c]), io::PixelType::float32, &stored, c});
    file.origin_x = data.min_x;
    file.origin_y = data.min_y;
    file.display_window = display;
    return io::write_planes_exr(path, file, {.on_existing = io::OnExisting::overwrite}).status();
}

// A cropped ground truth is not completed with black, unless the input is clear there too.
TEST_F(TruthFiles, ACroppedDataWindowMustCoverThatOfTheInput) {
    test::write_truth(folder_.path(), 1, 3, 0.1f);
    const io::Window data = {9, 4, 50, 39};
    const ImageF picture(64, 40, 3, 0.5f);
    ASSERT_TRUE(write_cropped(folder_.path("truth.0002.exr"), picture, data).ok());
    expect_refused("the data window of the ground truth is 42x36 (9, 4)-(50, 39), but that of ");
    EXPECT_THAT(test::error_of(truth()), HasSubstr("in.0002.exr is 64x40 (0, 0)-(63, 39)"));
    ASSERT_TRUE(write_cropped(folder_.path("in.0002.exr"), picture, data).ok());
    EXPECT_EQ(test::error_of(truth()), "");
}

// Within one display window the same pixels are compared, whatever each file's data window.
TEST_F(TruthFiles, AnotherDataWindowIsAligned) {
    test::write_truth(folder_.path(), 1, 3, 0.1f);
    const ImageF whole = test::must(test::must(truth()).load(2)).rgb;
    ASSERT_TRUE(write_cropped(folder_.path("truth.0002.exr"), whole, {-5, -2, 70, 41}).ok());
    EXPECT_EQ(test::must(test::must(truth()).load(2)).rgb, whole);
}

TEST_F(TruthFiles, InfNanAndBlackAreRefused) {
    test::write_truth(folder_.path(), 1, 3, 0.1f);
    for (const float bad :
         {std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()}) {
        ImageF image(64, 40, 3, 0.5f);
        image.at(7, 9, 1) = bad;
        test::write_rgb(folder_.path("truth.0001.exr"), image);
        expect_refused("1 pixel with NaN or Inf, the first at (7, 9)");
    }
    test::write_rgb(folder_.path("truth.0001.exr"), ImageF(64, 40, 3, 0.0f));
    expect_refused("the ground truth is black");
}

// Minimum start and maximum stop over the frames: for constant images, the dark one gives both, 2
// stops above those of the bright one.
TEST_F(TruthFiles, ExposuresAreThoseOfAllFramesTogether) {
    for (const auto& [name, value] :
         {std::pair{"truth.0001.exr", 1.0f}, {"truth.0002.exr", 0.25f}, {"truth.0003.exr", 1.0f}})
        test::write_rgb(folder_.path(name), ImageF(64, 40, 3, value));
    const auto range = test::must(truth()).exposures();
    EXPECT_NEAR(range.stop - range.start, 2, 1e-5);
}

TEST_F(TruthFiles, GeneratedScenesAreKnownByTheirCameraFile) {
    const sequence::RunSettings run = settings().run;
    const auto survey = test::must(survey_input(run, metrics::ToneMapper::aces, false));
    const auto why_not = [&] { return find_scene(run, survey).why_not; };
    EXPECT_THAT(why_not(), HasSubstr("camera.json to name a scene"));
    scenes::SceneRequest request;
    request.name = "zoom";
    request.frames = {1, 2, 3};
    request.camera.f_stop = 0.7;
    const auto write_camera = [&] {
        test::write_text(folder_.path("camera.json"),
                         scenes::camera_json(request, test::must(scenes::model_for(request))));
    };
    write_camera();
    const SceneOfInput found = find_scene(run, survey);
    ASSERT_TRUE(found.request) << found.why_not;
    EXPECT_EQ(found.request->name, "zoom");
    EXPECT_EQ(found.request->width, 64);
    EXPECT_EQ(found.request->frames, (std::vector<int>{1, 2, 3}));
    EXPECT_DOUBLE_EQ(*found.request->camera.f_stop, 0.7);
    // zoom animates focal length and focus itself.
    EXPECT_FALSE(found.request->camera.focal_length_mm);
    // The ground truth uses the same aperture image; without it there is no ground truth.
    ImageF picture(BokehKernel::kSide, BokehKernel::kSide, 1);
    picture.at(64, 30) = 1;
    request.camera.aperture_image = *BokehKernel::make(picture.data);
    write_camera();
    EXPECT_THAT(why_not(), HasSubstr("aperture.exr: no such file"));
    test::must(io::write_planes_exr(folder_.path("aperture.exr"), picture, {"Y"}));
    const SceneOfInput through = find_scene(run, survey);
    ASSERT_TRUE(through.request) << through.why_not;
    EXPECT_EQ(through.request->camera.aperture_image, request.camera.aperture_image);
    test::write_text(folder_.path("camera.json"), R"({"scene": "zoom", "f_stop": 2})");
    EXPECT_THAT(why_not(), HasSubstr("names no generated scene"));
}

// Values of the chain, of the pass and of the camera file, each against that of the scene.
TEST_F(TruthFiles, ValuesThatDifferFromThoseOfTheSceneAreNamed) {
    sequence::SourceSettings source = settings().run.source;
    scenes::SceneRequest request;
    request.name = "still";
    const Camera of_scene = scenes::camera_at(test::must(scenes::model_for(request)), 1);
    source.camera = CameraFile();
    source.camera->camera = of_scene;
    const auto differences = [&](const char* passes, const std::vector<std::string>& sets) {
        const auto header = test::must(
            sequence::open_source_frame(source, {{Role::color, folder_.path("in.0001.exr")}}, 1));
        return differences_from_truth(
            test::parse(concat("postchain: 1\npasses: [", passes, "]\n"), sets), header, of_scene);
    };
    using ::testing::ElementsAre;
    EXPECT_THAT(differences("depth_of_field, motion_blur, fxaa", {}), ElementsAre());
    const std::string f_stop = text_of(ParameterValue(*of_scene.f_stop)),
                      shutter = text_of(ParameterValue(*of_scene.shutter_frames));
    EXPECT_THAT(differences("depth_of_field, motion_blur", {"camera.f_stop=0.25"}),
                ElementsAre("f_stop 0.25 in place of " + f_stop));
    EXPECT_THAT(differences("motion_blur: {shutter_angle_deg: 36}", {}),
                ElementsAre("shutter_frames 0.1 in place of " + shutter));
    EXPECT_THAT(differences("depth_of_field: {aperture_blades: 5}", {}),
                ElementsAre("aperture_blades 5 in place of 0"));
    source.camera->camera.shutter_frames = 0.125;
    EXPECT_THAT(differences("depth_of_field, motion_blur", {}),
                ElementsAre("shutter_frames 0.125 in place of " + shutter));
    source.camera.reset();
    EXPECT_THAT(differences("motion_blur", {}), ElementsAre());  // the default is the scene's
}

// On another thread: the renderer makes a GL context and leaves none current.
std::string generated(const scenes::SceneRequest& request, const std::string& folder, int samples) {
    return std::async(std::launch::async,
                      [&] {
                          return test::must(
                              generate_truth(request, folder, samples, io::OutputFiles(), {}, {}));
                      })
        .get();
}

TEST(GeneratedTruth, IsTheSceneThroughLensAndShutter) {
    const test::TempFolder folder;
    scenes::SceneRequest request;
    request.name = "wheels";
    request.width = 37;
    request.height = 33;
    request.frames = {2, 3};
    request.truth_samples = 2;
    request.camera.shutter_frames = 0.25;
    const std::string pattern = generated(request, folder.path("truth"), 2);
    const auto path = [&](int frame) {
        return test::must(io::PathPattern::parse(pattern)).format(frame);
    };
    const ImageF expected =
        std::async(std::launch::async, [&] {
            const auto renderer = test::must(scenes::SceneRenderer::create());
            return test::must(scenes::render_frame(*renderer, request, 3, scenes::Picture::both))
                .color;
        }).get();
    auto file = test::must(io::ExrFile::open(path(3)));
    EXPECT_EQ(test::must(file.read_channels(0, {"R", "G", "B", "A"})), expected);
    // What an interrupted run has left is kept, and the rest is made.
    const auto time = std::filesystem::last_write_time(path(2));
    std::filesystem::remove(path(3));
    EXPECT_EQ(generated(request, folder.path("truth"), 2), pattern);
    EXPECT_TRUE(std::filesystem::exists(path(3)));
    EXPECT_EQ(std::filesystem::last_write_time(path(2)), time);
    // Another lens, shutter or number of samples is another ground truth.
    EXPECT_NE(generated(request, folder.path("truth"), 3), pattern);
    request.camera.shutter_frames = 0.5;
    EXPECT_NE(generated(request, folder.path("truth"), 2), pattern);
}

Status prepare(const std::string& folder, io::OnExisting on_existing) {
    ExperimentSettings settings;
    settings.folder = folder;
    settings.on_existing = on_existing;
    return prepare_folder(settings).status();
}

TEST(ReportFolder, StrangersAreNeverTouched) {
    const test::TempFolder folder;
    std::filesystem::create_directories(folder.path("images"));
    for (const std::string& mine : {folder.path("file"), folder.path("images/mine.txt")})
        test::write_text(mine, "mine");
    for (const auto choice :
         {io::OnExisting::fail, io::OnExisting::skip, io::OnExisting::overwrite}) {
        const Status status = prepare(folder.path(), choice);
        EXPECT_EQ(status.code(), StatusCode::output);
        EXPECT_THAT(status.message(), HasSubstr("not empty and is not a report"));
    }
    EXPECT_TRUE(std::filesystem::exists(folder.path("images/mine.txt")));
    EXPECT_EQ(prepare(folder.path("file"), io::OnExisting::overwrite).code(), StatusCode::output);
}

TEST(ReportFolder, AReportIsKeptResumedOrReplaced) {
    const test::TempFolder folder;
    const std::string report = folder.path("new/report");
    ASSERT_TRUE(prepare(report, io::OnExisting::fail).ok());
    // A report that has not begun does not count as one.
    ASSERT_TRUE(prepare(report, io::OnExisting::fail).ok());
    test::write_text(report + "/report.json", "{}");
    test::write_text(report + "/notes.txt", "of the user");
    EXPECT_THAT(prepare(report, io::OnExisting::fail).message(),
                HasSubstr("{on_existing=overwrite}"_keyed));
    EXPECT_TRUE(prepare(report, io::OnExisting::skip).ok());
    EXPECT_TRUE(std::filesystem::exists(report + "/report.json"));
    EXPECT_TRUE(prepare(report, io::OnExisting::overwrite).ok());
    EXPECT_FALSE(std::filesystem::exists(report + "/report.json"));
    EXPECT_TRUE(std::filesystem::exists(report + "/notes.txt"));
}

class ReplacedReport : public ::testing::Test {
  protected:
    void SetUp() override { ASSERT_TRUE(prepare(report_, io::OnExisting::fail).ok()); }
    void write(const std::string& name) const {
        const std::filesystem::path path = report_ + "/" + name;
        std::filesystem::create_directories(path.parent_path());
        test::write_text(path, "text");
    }
    // Writes the files, replaces the report, and returns those of the files that are left.
    std::vector<std::string> left_of(const std::vector<std::string>& names) const {
        for (const auto& name : names) write(name);
        EXPECT_TRUE(prepare(report_, io::OnExisting::overwrite).ok());
        std::vector<std::string> left;
        for (const auto& name : names)
            if (std::filesystem::exists(report_ + "/" + name)) left.push_back(name);
        return left;
    }
    test::TempFolder folder_;
    std::string report_ = folder_.path("report");
};

TEST_F(ReplacedReport, LosesItsOwnFilesAlone) {
    EXPECT_THAT(
        left_of({"results/paper.1.json", "results/paper.-12.json", "results/paper.time.json",
                 "truth/0a/both.0001.exr", "images/paper.0001.exr", "images/paper.-0001.exr",
                 "index.html", "report.csv", "report.md"}),
        ::testing::IsEmpty());
    EXPECT_FALSE(std::filesystem::exists(report_ + "/results"));
    EXPECT_FALSE(std::filesystem::exists(report_ + "/truth"));
    const std::vector<std::string> mine = {"results/paper.mine.json", "results/1.json",
                                           "results/.1.json",         "results/paper.1.txt",
                                           "results/paper..json",     "results/paper.-.json",
                                           "truth/0a/sharp.0001.exr", "truth/0a/both.exr",
                                           "truth/mine.exr",          "images/paper.1.exr",
                                           "images/paper.000a.exr",   "images/0001.exr",
                                           "images/old/a.0001.exr",   "report.txt"};
    EXPECT_EQ(left_of(mine), mine);
}

// The list of a report says which pictures are its own.
TEST_F(ReplacedReport, LosesTheListedPictures) {
    for (const char* list : {R"({"images": [{"path": "images/a.png"}, {"path": 1}, {}, 2]})",
                             R"({"images": {"path": "images/a.png"}})", R"([1])", "{"}) {
        test::write_text(report_ + "/report.json", list);
        const bool is_list = std::string(list).find("}, 2]") != std::string::npos;
        EXPECT_THAT(left_of({"images/a.png", "images/b.0001.exr"}),
                    ::testing::ElementsAre(is_list ? "images/b.0001.exr" : "images/a.png"))
            << list;
        std::filesystem::remove_all(report_ + "/images");
    }
}

// Links lead out of the report.
TEST_F(ReplacedReport, LeavesWhatItsLinksNameAlone) {
    const std::string mine = folder_.path("mine");
    std::filesystem::create_directory(mine);
    for (const char* name : {"/both.0001.exr", "/paper.1.json", "/paper.0001.exr"})
        test::write_text(mine + name, "mine");
    std::filesystem::create_directory(report_ + "/truth");
    for (const char* link : {"/truth/0a", "/results", "/images"})
        std::filesystem::create_directory_symlink(mine, report_ + link);
    EXPECT_TRUE(prepare(report_, io::OnExisting::overwrite).ok());
    std::filesystem::remove_all(report_ + "/truth");
    std::filesystem::create_directory_symlink(mine, report_ + "/truth");
    std::filesystem::create_directory(mine + "/0a");
    test::write_text(mine + "/0a/both.0001.exr", "mine");
    EXPECT_TRUE(prepare(report_, io::OnExisting::overwrite).ok());
    for (const char* name :
         {"/both.0001.exr", "/paper.1.json", "/paper.0001.exr", "/0a/both.0001.exr"})
        EXPECT_TRUE(std::filesystem::exists(mine + name)) << name;
}

}  // namespace
}  // namespace postchain::experiment
