// Report folders of ab and bench: a foreign folder is refused, a report is replaced only on
// request.
#include "tests/command/replace_fixture.h"

namespace postchain::test::replace_report_test {
namespace {

// A report needs its own folder.
class ReplaceReportTest : public ReplaceTest {
  protected:
    Arguments ab(const std::string& folder = "r", const Arguments& more = {}) const {
        return with(
            with({"ab", at("fxaa.yaml"), at("motion_blur.yaml"), "-o", to(folder)}, reads()), more);
    }
    Arguments bench(const Arguments& more = {}) const {
        return with(with({"bench", at("fxaa.yaml"), "-o", to("r"), "--split-frames", "0", "--under",
                          "mse=1"},
                         reads()),
                    more);
    }
    Arguments reads() const { return {"-i", in(), "-r", in(), "--frames", "1", "--repeats", "1"}; }
    static Arguments with(Arguments command, const Arguments& more) {
        command.insert(command.end(), more.begin(), more.end());
        return command;
    }
    void mark(const std::string& folder) const {
        fs::create_directories(to(folder));
        write_text(to(folder + "/.postchain-report"), "This folder is a report of postchain.\n");
    }
    // Refused with this code, and w/ is unchanged.
    void expect_refused(const Arguments& command, int code) {
        std::map<std::string, std::string> before;
        for (const auto& file : files()) before[file] = read_text(file);
        const auto outcome = run(command);
        EXPECT_EQ(outcome.code, code) << outcome.text();
        std::map<std::string, std::string> after;
        for (const auto& file : files()) after[file] = read_text(file);
        EXPECT_TRUE(before == after) << outcome.text();
        expect_remedy(outcome, command[0]);
    }
};

TEST_F(ReplaceReportTest, EveryFileOfAStrangersFolder) {
    for (const char* file : {"index.html", "images/input.0001.exr"})
        for (const Arguments& command : {ab(), bench()})
            for (const char* choice : {"fail", "overwrite"}) {
                SCOPED_TRACE(std::string(file) + " " + choice);
                fresh();
                fs::create_directories(fs::path(to("r/") + file).parent_path());
                write_text(to("r/") + file, kStranger);
                expect_refused(with(command, {"--on-existing", choice}), 5);
            }
}

TEST_F(ReplaceReportTest, AReportIsReplacedOnlyWhenAsked) {
    ASSERT_EQ(run(ab()).code, 0);
    expect_refused(ab(), 5);
    EXPECT_EQ(run(ab("r", {"--on-existing", "overwrite"})).code, 0);
    // Bench continues by itself.
    fresh();
    ASSERT_EQ(run(bench()).code, 0);
    EXPECT_TRUE(exists(to("r/under_mse.yaml")));
    EXPECT_EQ(run(bench()).code, 0);
    expect_refused(bench({"--on-existing", "fail"}), 5);
}

TEST_F(ReplaceReportTest, OnlyFilesOfTheReportAreRemoved) {
    const std::string own[] = {"notes.txt",         "images/grade.txt", "images/plate.0001.exr",
                               "results/table.csv", "truth/from.txt",   "results/mine.json"};
    ASSERT_EQ(run(ab()).code, 0);
    ASSERT_TRUE(exists(to("r/images/input.0001.exr")));
    fs::create_directories(to("r/results"));
    fs::create_directories(to("r/truth"));
    for (const std::string& file : own) write_text(to("r/" + file), kStranger);
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
        for (const Arguments& command : {ab(), bench()})
            for (const char* choice : {"fail", "overwrite"}) {
                SCOPED_TRACE(std::string(file) + " " + choice);
                fresh();
                mark("r");
                fs::create_directories(fs::path(to("r/") + file).parent_path());
                write_text(to("r/") + file, kCamera);
                expect_refused(
                    with(command, {"--on-existing", choice, "--camera", to("r/") + file}), 2);
            }
    fresh();
    mark("r");
    write_text(to("r/chain.yaml"), kFxaa);
    Arguments command = bench({"--on-existing", "overwrite"});
    command[1] = to("r/chain.yaml");
    expect_refused(command, 2);
    // The ground truth too, which is removed with the report.
    fs::create_directories(to("r/truth"));
    fs::copy_file(in(1), to("r/truth/t.0001.exr"));
    command = bench({"--on-existing", "overwrite"});
    for (size_t i = 0; i + 1 < command.size(); ++i)
        if (command[i] == "-r") command[i + 1] = to("r/truth/t.####.exr");
    expect_refused(command, 2);
}

TEST_F(ReplaceReportTest, PicturesOfAPageHaveAFolderOfTheirOwn) {
    fs::create_directory(to("p"));
    write_text(to("p/image-0.js"), kStranger);
    for (const char* choice : {"fail", "overwrite"})
        expect_refused(ab("r", {"--assets", to("p"), "--on-existing", choice}), 5);
    fs::remove_all(to("p"));
    ASSERT_EQ(run(ab("r", {"--assets", to("p")})).code, 0);
    const std::string picture = read_text(to("p/image-0.js"));
    EXPECT_FALSE(picture.empty());
    // Another report in the same folder: the first one's page would show its images.
    for (const char* choice : {"fail", "overwrite"})
        expect_refused(ab("s", {"--assets", to("p"), "--on-existing", choice}), 5);
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
