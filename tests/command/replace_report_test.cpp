// Report folders of ab and bench: a foreign folder is refused, a report is replaced only on
// request.
#include "tests/command/replace_fixture.h"

namespace postchain::test::replace_report_test {
namespace {

// A report needs its own folder.
class ReplaceReportTest : public ReplaceTest {
  protected:
    Arguments ab(const std::string& folder = "r", const Arguments& more = {}) const {
        return joined(
            joined({"ab", at("fxaa.yaml"), at("motion_blur.yaml"), "-o", to(folder)}, reads()),
            more);
    }
    Arguments bench(const Arguments& more = {}) const {
        return joined(joined({"bench", at("fxaa.yaml"), "-o", to("r"), "--split-frames", "0",
                              "--under", "mse=1"},
                             reads()),
                      more);
    }
    Arguments reads() const { return {"-i", in(), "-r", in(), "--frames", "1", "--repeats", "1"}; }
    void mark() const {
        write(to("r/.postchain-report"), "This folder is a report of postchain.\n");
    }
    // Refused with this code whatever --on-existing, and w/ is unchanged.
    void expect_refused(const Arguments& command, int code) {
        const auto contents = [&] {
            std::map<std::string, std::string> texts;
            for (const auto& file : files()) texts[file] = read_text(file);
            return texts;
        };
        const auto before = contents();
        for (const char* choice : {"fail", "overwrite"}) {
            const auto outcome = run(joined(command, {"--on-existing", choice}));
            EXPECT_EQ(outcome.code, code) << choice << outcome.text();
            EXPECT_TRUE(contents() == before) << choice << outcome.text();
            expect_remedy(outcome, command[0]);
        }
    }
};

TEST_F(ReplaceReportTest, EveryFileOfAStrangersFolder) {
    for (const char* file : {"index.html", "images/input.0001.exr"})
        for (const Arguments& command : {ab(), bench()}) {
            SCOPED_TRACE(file);
            fresh();
            write(to("r/") + file, kStranger);
            expect_refused(command, 5);
        }
}

TEST_F(ReplaceReportTest, AReportIsReplacedOnlyWhenAsked) {
    for (const Arguments& command : {ab(), bench()}) {
        fresh();
        ASSERT_EQ(run(command).code, 0);
        EXPECT_EQ(run(joined(command, {"--on-existing", "fail"})).code, 5);
        EXPECT_EQ(run(command).code, command[0] == "ab" ? 5 : 0);  // bench continues by itself
        EXPECT_EQ(run(joined(command, {"--on-existing", "overwrite"})).code, 0);
    }
    EXPECT_TRUE(exists(to("r/under_mse.yaml")));
}

TEST_F(ReplaceReportTest, OnlyFilesOfTheReportAreRemoved) {
    const std::string own[] = {"notes.txt",         "images/grade.txt", "images/plate.0001.exr",
                               "results/table.csv", "truth/from.txt",   "results/mine.json"};
    ASSERT_EQ(run(ab()).code, 0);
    ASSERT_TRUE(exists(to("r/images/input.0001.exr")));
    for (const std::string& file : own) write(to("r/" + file), kStranger);
    write_text(to("r/results/old.0001.json"), kStranger);
    write_text(to("r/images/input.0001.exr"), kStranger);
    ASSERT_EQ(run(ab("r", {"--on-existing", "overwrite"})).code, 0);
    for (const std::string& file : own)
        EXPECT_EQ(exists(to("r/" + file)) ? read_text(to("r/" + file)) : "", kStranger) << file;
    EXPECT_FALSE(exists(to("r/results/old.0001.json")));
    EXPECT_FALSE(read_text(to("r/images/input.0001.exr")) == kStranger);
    // Without a list, the form of the names decides.
    write_text(to("r/images/stale.0007.exr"), kStranger);
    fs::remove(to("r/report.json"));
    ASSERT_EQ(run(ab("r", {"--on-existing", "overwrite"})).code, 0);
    EXPECT_FALSE(exists(to("r/images/stale.0007.exr")));
    EXPECT_TRUE(exists(to("r/images/grade.txt")));
}

// Also if the report does not contain it: a report could have used that name.
TEST_F(ReplaceReportTest, NoInputLiesInTheFolder) {
    for (const char* file : {"report.json", "images/camera.json", "mine.json"})
        for (const Arguments& command : {ab(), bench()}) {
            SCOPED_TRACE(file);
            fresh();
            mark();
            write(to("r/") + file, kCamera);
            expect_refused(joined(command, {"--camera", to("r/") + file}), 2);
        }
    fresh();
    mark();
    write_text(to("r/chain.yaml"), kFxaa);
    expect_refused(word(1)(bench(), to("r/chain.yaml")), 2);
    // The ground truth too, which is removed with the report.
    fs::create_directories(to("r/truth"));
    fs::copy_file(in(1), to("r/truth/t.0001.exr"));
    const Arguments command = bench();
    const auto truth = std::find(command.begin(), command.end(), "-r") - command.begin();
    expect_refused(word(size_t(truth) + 1)(command, to("r/truth/t.####.exr")), 2);
}

TEST_F(ReplaceReportTest, PicturesOfAPageHaveAFolderOfTheirOwn) {
    write(to("p/image-0.js"), kStranger);
    expect_refused(ab("r", {"--assets", to("p")}), 5);
    fs::remove_all(to("p"));
    ASSERT_EQ(run(ab("r", {"--assets", to("p")})).code, 0);
    EXPECT_FALSE(read_text(to("p/image-0.js")).empty());
    // Another report in the same folder: the first one's page would show its images.
    expect_refused(ab("s", {"--assets", to("p")}), 5);
    EXPECT_EQ(run(ab("r", {"--assets", to("p"), "--on-existing", "overwrite"})).code, 0);
    // Inside the report's folder, and the folder itself.
    fresh();
    EXPECT_EQ(run(ab("r", {"--assets", to("r/pictures")})).code, 0);
    EXPECT_EQ(run(ab("r", {"--assets", to("r/pictures"), "--on-existing", "overwrite"})).code, 0);
    EXPECT_EQ(run(ab("s", {"--assets", to("s")})).code, 0);
    EXPECT_TRUE(exists(to("s/image-0.js")));
}

}  // namespace
}  // namespace postchain::test::replace_report_test
