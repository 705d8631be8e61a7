// postchain study as processes: split, killed, taken up again.
#include <csignal>
#include <regex>

#include "tests/command/fixture.h"

namespace postchain::test {
namespace {

namespace fs = std::filesystem;

class StudyCommand : public CommandTest {
  protected:
    void SetUp() override {
        CommandTest::SetUp();
        write_text(at("directional.yaml"), "postchain: 1\npasses: [fxaa: {mode: directional}]\n");
        for (const char* scene : {"a", "b", "c"}) {
            const std::string truth = at(concat(scene, "/truth"));
            fs::create_directories(truth);
            for (const std::string& folder : {at(scene), truth})
                write_sequence(folder, {1, 2}, scene[0] == 'b' ? 40 : 48, 32);
        }
        write_study(scene("a") + scene("b") + scene("c"));
    }
    static std::string scene(const std::string& name, const std::string& truth = "in.####.exr") {
        return "  - {name: " + name + ", input: '" + name + "/in.####.exr', truth: '" + name +
               "/truth/" + truth + "'}\n";
    }
    void write_study(const std::string& scenes) {
        write_text(at("study.yaml"),
                   "postchain_study: 1\nchains: {plain: fxaa.yaml, along: directional.yaml}\n"
                   "settings: {repeats: 1}\nscenes:\n" +
                       scenes);
    }
    Arguments study(const std::string& folder, const Arguments& more = {}) const {
        Arguments all = {"study", at("study.yaml"), "-o", at(folder), "--device", "software"};
        all.insert(all.end(), more.begin(), more.end());
        return all;
    }
    // All that the study says: equal bytes however it was split.
    std::string report(const std::string& folder) const {
        std::string text;
        for (const char* name : {"report.json", "report.csv", "report.md", "index.html"}) {
            EXPECT_TRUE(exists(at(folder + "/" + name))) << name;
            text += read_text(at(folder + "/" + name));
        }
        return text;
    }
    size_t results(const std::string& folder) const {
        std::error_code error;
        size_t count = 0;
        for (const auto& entry : fs::directory_iterator(at(folder + "/tasks"), error))
            count +=
                entry.path().extension() == ".json" && entry.path().filename().string()[0] != '.';
        return count;
    }
};

TEST_F(StudyCommand, ItsGainsAreThoseOfAb) {
    const auto outcome = run(study("study", {"--json"}));
    ASSERT_EQ(outcome.code, 0) << outcome.text();
    const Json json = Json::parse(read_text(at("study/report.json")));
    EXPECT_EQ(json_lines(outcome.out).back()["verdict"].get<std::string>().find('\n'),
              std::string::npos);
    const auto alone = run({"ab", at("fxaa.yaml"), at("directional.yaml"), "-i",
                            at("b/in.####.exr"), "-r", at("b/truth/in.####.exr"), "-o", at("alone"),
                            "--device", "software", "--repeats", "1"});
    ASSERT_EQ(alone.code, 0) << alone.text();
    const Json ab = Json::parse(read_text(at("alone/report.json")));
    size_t compared = 0;
    for (const Json& table : json["tables"])
        for (const Json& metric : ab["comparison"]["metrics"]) {
            if (metric["metric"] != table["metric"] || metric["mean"].is_null()) continue;
            const double sign = table["better"] == "higher" ? 1 : -1;
            EXPECT_NEAR(table["scenes"][1]["gains"][0].get<double>(),
                        sign * metric["mean"].get<double>(), 1e-12)
                << table["metric"];
            ++compared;
        }
    EXPECT_GE(compared, 8u);
    EXPECT_TRUE(exists(at("study/scenes/b/plain_vs_along/index.html")));
    EXPECT_TRUE(
        contains(read_text(at("study/index.html")), "\"scenes/b/plain_vs_along/index.html\""));
}

TEST_F(StudyCommand, TwoProcessesAndPartsGiveTheBytesOfOne) {
    ASSERT_EQ(run(study("one")).code, 0);
    {
        Process first(with_command(study("two"))), second(with_command(study("two")));
        EXPECT_EQ(first.wait().code, 0);
        EXPECT_EQ(second.wait().code, 0);
    }
    EXPECT_EQ(report("two"), report("one"));
    for (const char* part : {"3/3", "1/3"}) {
        EXPECT_EQ(run(study("parts", {"--chunk", part})).code, 0);
        EXPECT_FALSE(exists(at("parts/report.json")));
    }
    EXPECT_EQ(run(study("parts", {"--chunk", "2/3"})).code, 0);
    EXPECT_EQ(report("parts"), report("one"));
    for (const auto& entry : fs::directory_iterator(at("parts/tasks")))
        EXPECT_EQ(entry.path().extension(), ".json") << entry.path();
}

TEST_F(StudyCommand, AKilledOneIsTakenUpAgain) {
    ASSERT_EQ(run(study("whole")).code, 0);
    for (size_t after = 0; after < 3; ++after) {
        const std::string folder = "killed" + std::to_string(after);
        {
            Process process(with_command(study(folder)));
            process.until([&] { return results(folder) >= after; });
            process.send(SIGKILL);
            process.wait();
        }
        const size_t kept = results(folder);
        const auto outcome = run(study(folder));
        ASSERT_EQ(outcome.code, 0) << outcome.text();
        EXPECT_GE(kept, after);
        EXPECT_EQ(report(folder), report("whole")) << "killed after " << kept << " results";
    }
}

TEST_F(StudyCommand, ASceneThatFailsIsNamedAndTheOthersStand) {
    write_study(scene("a") + scene("b", "none.####.exr") + scene("missing"));
    expect_ends(run(study("study")), 1, {"scene b: ", "none.0001.exr", "scene missing: "});
    const Json json = Json::parse(read_text(at("study/report.json")));
    EXPECT_EQ(json["tables"][0]["scenes"].size(), 1u);
    EXPECT_TRUE(contains(json["scenes"][1]["failure"], "the ground truth has no file"));
    // When the truth is there, only that scene is measured.
    const auto time = fs::last_write_time(at("study/tasks/a.plain_vs_along.json"));
    for (const char* frame : {"1", "2"})
        fs::copy_file(at("b/truth/in.000" + std::string(frame) + ".exr"),
                      at("b/truth/none.000" + std::string(frame) + ".exr"));
    EXPECT_EQ(run(study("study")).code, 1);
    EXPECT_EQ(fs::last_write_time(at("study/tasks/a.plain_vs_along.json")), time);
    EXPECT_EQ(Json::parse(read_text(at("study/report.json")))["tables"][0]["scenes"].size(), 2u);
}

TEST_F(StudyCommand, ResultsOfAnotherStudyAreRefused) {
    ASSERT_EQ(run(study("study")).code, 0);
    const std::string before = report("study");
    write_text(at("fxaa.yaml"), "postchain: 1\npasses: [fxaa: {preset: 39}]\n");
    expect_ends(run(study("study")), 2, {"was made from"});
    EXPECT_EQ(report("study"), before);
    EXPECT_EQ(run(study("study", {"--on-existing", "overwrite"})).code, 0);
}

// The commit and the chains are frozen in the report, and a script that shares no code with the
// program finds the same figures, and none that are false.
TEST_F(StudyCommand, ItsFiguresAreRecomputed) {
    write_text(at("study.yaml"),
               "postchain_study: 1\nkind: bench\nsettings: {repeats: 1, split_frames: 0, "
               "stability_frames: 0}\n"
               "chains: {low: [fxaa: {preset: 12}], high: [fxaa: {preset: 39}], along: "
               "directional.yaml}\n"
               "questions: [{pair: [low, high], equal: time}, [low, along], [high, along]]\n"
               "scenes:\n" +
                   scene("a") + scene("b") + scene("c"));
    const auto outcome = run(study("study"));
    ASSERT_EQ(outcome.code, 0) << outcome.text();
    Json json = Json::parse(read_text(at("study/report.json")));
    ASSERT_EQ(json["revisions"].size(), 1u);
    EXPECT_TRUE(std::regex_match(json["revisions"][0].get<std::string>(),
                                 std::regex("[0-9a-f]{40}(-dirty)?|unknown")))
        << json["revisions"];
    EXPECT_TRUE(contains(json["variants"][1]["chain"].get<std::string>(), "preset: 39"));
    EXPECT_GT(json["pairs"][0]["time_ratio"].get<double>(), 0);
    EXPECT_TRUE(json["pairs"][1]["time_ratio"].is_null());
    EXPECT_TRUE(contains(outcome.out, "equal time: "));
    EXPECT_TRUE(exists(at("study/scenes/a/index.html")));
    const auto recompute = [&](const std::string& what) {
        return run_program({"python3", "-B", STUDY_RECOMPUTE, at(what)});
    };
    for (const char* what : {"study", "study/report.json"})
        expect_prints(recompute(what), 0, {" 0 differ"});
    for (const char* key : {"gain", "probability", "probability_holm", "finding"}) {
        Json changed = json;
        Json& value = changed["tables"][0]["pairs"][1][key];
        value = value.is_string() ? Json("too_few_families") : Json(value.get<double>() + 0.001);
        write_text(at("changed.json"), changed.dump());
        expect_ends(recompute("changed.json"), 1, {concat(": ", key, " is ")});
    }
}

}  // namespace
}  // namespace postchain::test
