// The folder of a study: which results it continues with, and which files it touches.
#include "tools/measure/study/study_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "passes/registry.h"
#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tests/support/text_file.h"
#include "tools/measure/study/study_reader.h"
#include "tools/sequence/files/json.h"

namespace postchain::study {
namespace {

namespace fs = std::filesystem;
using test::write_text;
using ::testing::HasSubstr;

struct Given {
    std::string version = "1.2.3", preset = "12", settings = "repeats: 2", scene = "s";
};

class StudyFolderTest : public ::testing::Test {
  protected:
    void SetUp() override {
        for (const char* name : {"in", "gt"}) fs::create_directory(at(name));
        for (const char* name : {"in/a.0001.exr", "in/a.0002.exr", "in/a.0003.exr", "in/a.0005.exr",
                                 "in/z.exr", "gt/truth.0002.exr"})
            write_text(at(name), "frame");
    }
    std::string at(const std::string& name) const { return folder_.path(name); }

    // Frame 2 alone; its neighbors are 1 and 3.
    Study study(const Given& given = {}) const {
        StudyFile file = read_study(
            "postchain_study: 1\nchains: {one: [fxaa: {preset: " + given.preset +
                "}], two: paper}\nsettings: {" + given.settings +
                "}\nscenes:\n  - {name: " + given.scene +
                ", input: 'color=in/a.####.exr,depth=in/z.exr', truth: 'gt/truth.####.exr', "
                "frames: 2}\n",
            at("study.yaml"), builtin_passes(), paths_beside(at("study.yaml")), given.version);
        EXPECT_EQ(text_of(file.diagnostics), "");
        return std::move(file.study);
    }
    Result<StudyFolder> open(const Study& study, const std::string& name = "out",
                             io::OnExisting on_existing = io::OnExisting::skip) const {
        return StudyFolder::open(study, at(name), on_existing);
    }
    // A folder with the result of the study's only task.
    void keep(const Study& study, const std::string& name, const std::string& failure = {}) const {
        const StudyFolder folder = test::must(open(study, name));
        TaskResult result;
        result.made_from = made_from(study, tasks_of(study)[0]);
        result.failure = failure;
        if (failure.empty()) result.variants = {{"one", {}, {}}, {"two", {}, {}}};
        ASSERT_EQ(test::error_of(folder.keep(tasks_of(study)[0], result)), "");
    }

    test::TempFolder folder_;
};

TEST_F(StudyFolderTest, AResultIsOfOneVersionOneChainTheseSettingsAndTheseFiles) {
    struct Row {
        const char* what;
        const char* said;  // "": the result is kept
        std::function<Given()> change;
    };
    const auto file = [this](const std::string& name) {
        return [this, name] {
            write_text(at(name), "a changed frame");
            return Given();
        };
    };
    const Row rows[] = {{"nothing", "", [] { return Given(); }},
                        {"a frame far away", "", file("in/a.0005.exr")},
                        {"version", "postchain 2", [] { return Given{.version = "2"}; }},
                        {"chain", "preset=39", [] { return Given{.preset = "39"}; }},
                        {"settings", "repeats=3", [] { return Given{.settings = "repeats: 3"}; }},
                        {"the frame", "frame a.0002.exr", file("in/a.0002.exr")},
                        {"the frame before", "frame a.0001.exr", file("in/a.0001.exr")},
                        {"the frame after", "frame a.0003.exr", file("in/a.0003.exr")},
                        {"the file of all frames", "frame z.exr", file("in/z.exr")},
                        {"the truth", "truth truth.0002.exr", file("gt/truth.0002.exr")},
                        {"the truth is gone", "and that is \"nothing\" now",
                         [this] {
                             fs::remove(at("gt/truth.0002.exr"));
                             return Given();
                         }},
                        {"it is back", "was made from \"nothing\"", file("gt/truth.0002.exr")}};
    for (const Row& row : rows) {
        keep(study(), row.what);
        keep(study(), concat(row.what, " failed"), "no memory");
        const Study changed = study(row.change());
        const auto again = open(changed, row.what);
        EXPECT_EQ(again.status().code(), *row.said ? StatusCode::usage : StatusCode::ok)
            << row.what;
        EXPECT_THAT(test::error_of(again), HasSubstr(row.said)) << row.what;
        // A scene that failed is tried again, whatever has changed since.
        EXPECT_EQ(test::error_of(open(changed, concat(row.what, " failed"))), "") << row.what;
    }
}

TEST_F(StudyFolderTest, ResultsAreReadBackAndThoseOfOtherScenesAreRefused) {
    const Study first = study();
    const Task task = tasks_of(first)[0];
    {
        const StudyFolder folder = test::must(open(first));
        EXPECT_FALSE(*folder.result(first, task));
        TaskResult result;
        result.made_from = made_from(first, task);
        result.frames = {2};
        result.width = 640;
        result.height = 360;
        result.truth = "gt";
        result.renderer = "device";
        result.revision = "abc";
        result.variants = {{"one", {{"mse", {0.5, std::nullopt}}}, 1.5}, {"two", {}, {}}};
        ASSERT_EQ(test::error_of(folder.keep(task, result)), "");
        const TaskResult back = *test::must(folder.result(first, task));
        EXPECT_EQ(back.made_from, result.made_from);
        EXPECT_EQ(back.frames, result.frames);
        EXPECT_EQ(std::tie(back.width, back.height), std::tie(result.width, result.height));
        EXPECT_EQ(std::tie(back.truth, back.renderer, back.revision),
                  std::tie(result.truth, result.renderer, result.revision));
        EXPECT_EQ(back.variants[0].metrics, result.variants[0].metrics);
        EXPECT_EQ(back.variants[0].time_ms, 1.5);
        EXPECT_FALSE(back.variants[1].time_ms);
    }
    const auto other = open(study({.scene = "t"}));
    EXPECT_EQ(other.status().code(), StatusCode::usage);
    EXPECT_THAT(test::error_of(other), HasSubstr("s.one_vs_two.json: belongs to another study"));
    const std::string kept = test::read_text(at("out/tasks/s.one_vs_two.json"));
    write_text(at("out/tasks/.t.one_vs_two.json"), kept);  // no result of a study
    EXPECT_EQ(test::error_of(open(first)), "");
    // Damaged: half of it, of another version, without a variant.
    const auto with = [&](const char* key, const io::Json& value) {
        io::Json json = io::Json::parse(kept);
        json[key] = value;
        return json.dump();
    };
    for (const std::string& text :
         {std::string("{"), with("postchain_task", 2), with("variants", io::Json::array())}) {
        write_text(at("out/tasks/s.one_vs_two.json"), text);
        EXPECT_THAT(test::error_of(open(first)), HasSubstr("is not a result of a study")) << text;
    }
}

TEST_F(StudyFolderTest, FilesOfOthersAreNotTouched) {
    fs::create_directory(at("mine"));
    write_text(at("mine/notes.txt"), "mine");
    EXPECT_EQ(open(study(), "mine").status().code(), StatusCode::output);
    EXPECT_FALSE(fs::exists(at("mine/tasks")));
    for (const char* holds_an_input : {"in", "gt"})
        EXPECT_EQ(open(study(), holds_an_input).status().code(), StatusCode::usage);
    // Removing a study removes its results and reports alone.
    keep(study(), "out");
    fs::create_directories(at("out/scenes"));
    const char* const own[] = {"out/notes.txt", "out/tasks/mine.json", "out/tasks/notes.txt",
                               "out/scenes/notes.txt"};
    for (const char* file : own) write_text(at(file), "mine");
    for (const char* name :
         {"out/report.json", "out/report.csv", "out/report.md", "out/index.html"})
        write_text(at(name), "{}");
    // The result of a scene that the study no longer has, and the claim of a run that was killed.
    keep(study({.scene = "t"}), "other");
    fs::copy(at("other/tasks/t.one_vs_two.json"), at("out/tasks"));
    write_text(at("out/tasks/t.one_vs_two.claim"), "");
    EXPECT_EQ(test::error_of(open(study(), "out", io::OnExisting::overwrite)), "");
    for (const char* file : own) EXPECT_TRUE(fs::exists(at(file))) << file;
    for (const char* file : {"out/tasks/s.one_vs_two.json", "out/tasks/t.one_vs_two.json",
                             "out/tasks/t.one_vs_two.claim", "out/report.json", "out/report.csv",
                             "out/report.md", "out/index.html"})
        EXPECT_FALSE(fs::exists(at(file))) << file;
}

TEST_F(StudyFolderTest, ReportsOfItsScenesAreRemovedIfTheyAreReports) {
    keep(study(), "out");
    for (const char* folder : {"s", "s/one_vs_two", "t/mine"})
        fs::create_directories(at(concat("out/scenes/", folder)));
    const std::string mark = concat("/", experiment::kFolderMark);
    for (const char* folder : {"out/scenes/s", "out/scenes/s/one_vs_two"})
        for (const std::string& name : {mark, std::string("/report.json")})
            write_text(at(folder + name), "{}");
    write_text(at("out/scenes/s/notes.txt"), "mine");
    write_text(at("out/scenes/t/mine/report.json"), "{}");
    EXPECT_EQ(test::error_of(open(study(), "out", io::OnExisting::overwrite)), "");
    EXPECT_FALSE(fs::exists(at("out/scenes/s/one_vs_two")));
    EXPECT_FALSE(fs::exists(at("out/scenes/s/report.json")));
    // The mark stays as long as there is a file of the user.
    for (const std::string& file :
         {"s" + mark, std::string("s/notes.txt"), std::string("t/mine/report.json")})
        EXPECT_TRUE(fs::exists(at("out/scenes/" + file))) << file;
    fs::remove(at("out/scenes/s/notes.txt"));
    EXPECT_EQ(test::error_of(open(study(), "out", io::OnExisting::overwrite)), "");
    EXPECT_FALSE(fs::exists(at("out/scenes/s")));
}

}  // namespace
}  // namespace postchain::study
