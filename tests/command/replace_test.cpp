// What is written and what is never replaced, of every verb and every file that it writes:
//   free          written
//   a stranger's  refused under --on-existing fail, and unchanged
//   an input      refused under every --on-existing, and unchanged, whatever its name looks like
#include <functional>
#include <regex>
#include <set>

#include "tests/command/fixture.h"

namespace postchain::test {
namespace {

namespace fs = std::filesystem;

const std::string kProfile =
    read_text(std::string(POSTCHAIN_SOURCE_DIR) + "/config/profiles/cycles.yaml");
const char* kCamera = "{\"f_stop\": 2, \"focal_length_mm\": 50, \"sensor_width_mm\": 36}";
const char* kStranger = "a stranger's";

// A command, and one of the files that it writes.
struct Writer {
    std::string file;
    Arguments command;
    // The same command with a file as one more input, and what that file holds.
    std::function<Arguments(Arguments, const std::string& path)> reading = {};
    std::string content = {};
};

std::function<Arguments(Arguments, const std::string&)> option(const std::string& name) {
    return [name](Arguments command, const std::string& path) {
        command.insert(command.end(), {name, path});
        return command;
    };
}

class ReplaceTest : public CommandTest {
  protected:
    void SetUp() override {
        CommandTest::SetUp();
        write_sequence(at(""), {1, 2});
        write_frame(at("other.0001.exr"), make_planes(48, 32, 2));
        fresh();
    }

    // Every file of a command lies in here.
    std::string to(const std::string& name) const { return at("w/" + name); }
    void fresh() const {
        fs::remove_all(at("w"));
        fs::create_directory(at("w"));
    }

    // Every option that a message names is one of the verb's.
    void expect_remedy(const Outcome& outcome, const std::string& verb) {
        if (help_of_ != verb) help_ = run({verb, "--help"}).out;
        help_of_ = verb;
        const std::regex word("--[a-z][a-z-]+");
        int count = 0;
        for (std::sregex_iterator it(outcome.err.begin(), outcome.err.end(), word), end; it != end;
             ++it) {
            ++count;
            EXPECT_TRUE(contains(help_, it->str()))
                << verb << " has no " << it->str() << ": " << outcome.err;
        }
        EXPECT_GT(count, 0) << "no remedy: " << outcome.err;
        for (const char* choice : {"skip", "overwrite"}) {
            const std::regex recommended(std::string("--on-existing [a-z ]*\\b") + choice);
            if (!std::regex_search(outcome.err, recommended)) continue;
            EXPECT_TRUE(choices().count(choice)) << choice << ": " << outcome.err;
        }
    }
    // Those of --on-existing.
    std::set<std::string> choices() const {
        std::smatch found;
        std::set<std::string> words;
        const std::regex line("--on-existing[^\\n{]*\\{([a-z,]+)\\}");
        if (!std::regex_search(help_, found, line)) return words;
        std::istringstream list(found[1].str());
        for (std::string word; std::getline(list, word, ',');) words.insert(word);
        return words;
    }

    void check(const Writer& writer) {
        SCOPED_TRACE(writer.file);
        const std::string verb = writer.command[0], path = to(writer.file);
        fresh();
        const auto free = run(writer.command);
        EXPECT_EQ(free.code, 0) << free.text();
        ASSERT_TRUE(fs::is_regular_file(path)) << free.text();

        fresh();
        fs::create_directories(fs::path(path).parent_path());
        write_text(path, kStranger);
        Arguments fail = writer.command;
        fail.insert(fail.end(), {"--on-existing", "fail"});
        const auto refused = run(fail);
        EXPECT_EQ(refused.code, 5) << refused.text();
        EXPECT_TRUE(read_text(path) == kStranger) << "it was replaced";
        EXPECT_TRUE(contains(refused.err, path)) << refused.err;
        expect_remedy(refused, verb);
        EXPECT_EQ(files().size(), 1u) << "something was written";

        if (!writer.reading) return;
        check_input(writer, "the file itself", [](const std::string&, const std::string&) {});
        check_input(writer, "a hard link", [](const std::string& from, const std::string& to) {
            fs::create_hard_link(from, to);
        });
        check_input(writer, "a symbolic link", [](const std::string& from, const std::string& to) {
            fs::create_symlink(from, to);
        });
    }

    // `link` makes the output of the input, which lies elsewhere; or it is the output.
    void check_input(const Writer& writer, const std::string& how,
                     const std::function<void(const std::string&, const std::string&)>& link) {
        SCOPED_TRACE(how);
        const std::string path = to(writer.file);
        for (const auto& choice : choices()) {
            fresh();
            fs::create_directories(fs::path(path).parent_path());
            std::string input = path;
            if (how != "the file itself") input = at("input_file.yaml");
            write_text(input, writer.content);
            link(input, path);
            // Written another way, too: an inode has no name.
            const std::string typed =
                how == "the file itself" ? at(".//w/../w/" + writer.file) : input;
            Arguments command = writer.reading(writer.command, typed);
            command.insert(command.end(), {"--on-existing", choice});
            const auto outcome = run(command);
            EXPECT_EQ(outcome.code, choice == "fail" ? outcome.code : 2) << outcome.text();
            EXPECT_NE(outcome.code, 0);
            EXPECT_TRUE(contains(outcome.err, path)) << outcome.err;
            EXPECT_TRUE(read_text(input) == writer.content) << "it was replaced";
            EXPECT_TRUE(fs::exists(path) && fs::equivalent(path, input));
            EXPECT_EQ(fs::is_symlink(path), how == "a symbolic link");
            EXPECT_EQ(files().size(), 1u) << "something was written";
            expect_remedy(outcome, writer.command[0]);
        }
    }

    std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const auto& entry : fs::recursive_directory_iterator(at("w")))
            if (!entry.is_directory()) names.push_back(entry.path().string());
        return names;
    }

    std::string help_of_, help_;  // a verb, and what it says of its options
};

TEST_F(ReplaceTest, Run) {
    const Arguments command = {
        "run",   at("fxaa.yaml"), "-i",        in(), "--frames", "1", "-o", to("o.####.exr"),
        "--png", "--dump-stages", to("stages")};
    for (const char* file :
         {"o.0001.exr", "o.0001.exr.json", "o.0001.png", "stages/0.fxaa.luma.0001.exr"})
        check({file, command, option("--camera"), kCamera});
}

TEST_F(ReplaceTest, RunProfileAndChain) {
    const Arguments command = {"run", at("fxaa.yaml"), "-i", in(), "--frames", "1",
                               "-o",  to("o.####.exr")};
    check({"o.0001.exr.json", command, option("--profile"), kProfile});
    check({"o.0001.exr.json", command,
           [](Arguments words, const std::string& path) {
               words[1] = path;
               return words;
           },
           kFxaa});
}

TEST_F(ReplaceTest, Diff) {
    const Arguments command = {"diff",      in(1),   at("other.0001.exr"),
                               "--metric",  "mse",   "--map",
                               to("m.png"), "--map", to("m.exr")};
    for (const char* file : {"m.png", "m.exr"})
        check({file, command, option("--profile"), kProfile});
}

TEST_F(ReplaceTest, Scene) {
    const Arguments command = {"scene", "still",  "-o",    to("s"),           "--frames",
                               "1",     "--size", "32x18", "--truth-samples", "1"};
    for (const char* file : {"s/gbuf.0001.exr", "s/sharp.0001.exr", "s/mb.0001.exr",
                             "s/dof.0001.exr", "s/both.0001.exr", "s/camera.json"})
        check({file, command});
}

TEST_F(ReplaceTest, PictureOfTheApertureOfAScene) {
    const char* picture = "P2\n2 2\n255\n255 255\n255 0\n";
    write_text(at("heart.pgm"), picture);
    const Arguments scene = {"scene",
                             "still",
                             "-o",
                             to("s"),
                             "--frames",
                             "1",
                             "--size",
                             "32x18",
                             "--truth-samples",
                             "0",
                             "--aperture-image",
                             at("heart.pgm")};
    for (const char* file : {"s/aperture.exr", "s/camera.json"})
        check({file, scene,
               [](Arguments words, const std::string& path) {
                   words.back() = path;
                   return words;
               },
               picture});
}

TEST_F(ReplaceTest, PictureOfTheApertureOfAChainOrCameraFile) {
    const char* picture = "P2\n2 2\n255\n255 255\n255 0\n";
    const auto setting = [](Arguments words, const std::string& path) {
        words.insert(words.end(), {"--set", "camera.aperture_image=" + path});
        return words;
    };
    check({"o.0001.exr.json",
           {"run", at("fxaa.yaml"), "-i", in(), "--frames", "1", "-o", to("o.####.exr")},
           setting,
           picture});
    check({"s/stress.json",
           {"stress", at("fxaa.yaml"), "--only", "/size/1*fp32", "-o", to("s")},
           setting,
           picture});
    write_text(at("camera.json"), "{\"aperture_image\": \"w/o.0001.png\"}");
    write_text(to("o.0001.png"), picture);
    const auto by_camera =
        run({"run", at("fxaa.yaml"), "-i", in(), "--frames", "1", "-o", to("o.####.exr"), "--png",
             "--camera", at("camera.json"), "--on-existing", "overwrite"});
    EXPECT_EQ(by_camera.code, 2) << by_camera.text();
    EXPECT_TRUE(contains(by_camera.err, "picture of the aperture")) << by_camera.err;
    EXPECT_EQ(read_text(to("o.0001.png")), picture);
}

TEST_F(ReplaceTest, Stress) {
    const Arguments command = {"stress", at("fxaa.yaml"), "--only", "/size/1*fp32", "-o", to("s")};
    for (const char* file : {"s/index.html", "s/stress.txt", "s/stress.json"})
        check({file, command,
               [](Arguments words, const std::string& path) {
                   words[1] = path;
                   return words;
               },
               kFxaa});
}

TEST_F(ReplaceTest, AnotherFramesInput) {
    for (const char* frame : {"9", "10", "11"})
        write_frame(to(std::string("f.") + frame + ".exr"), make_planes(24, 16));
    const std::string ten = read_text(to("f.10.exr"));
    // Frame 0 of f.1#.exr is f.10.exr; its output would be f.0.exr, frame 1's f.1.exr; of
    // f.1#.exr -> f.#0.exr the output of frame 1 is the input of frame 0.
    const Arguments command = {"run", at("fxaa.yaml"), "-i",       to("f.1#.exr"),
                               "-o",  to("f.#0.exr"),  "--frames", "1"};
    for (const char* choice : {"fail", "skip", "overwrite"}) {
        Arguments all = command;
        all.insert(all.end(), {"--on-existing", choice});
        const auto outcome = run(all);
        EXPECT_EQ(outcome.code, 2) << outcome.text();
        EXPECT_TRUE(contains(outcome.err, "f.10.exr")) << outcome.err;
        expect_remedy(outcome, "run");
        EXPECT_TRUE(read_text(to("f.10.exr")) == ten);
        EXPECT_EQ(files().size(), 3u);
    }
    // Two digits in, one out: f.9.exr is another sequence's and may be made.
    Arguments free = command;
    free[5] = to("g.#.exr");
    EXPECT_EQ(run(free).code, 0);
}

TEST_F(ReplaceTest, NoFrameIsAddedToWhatIsRead) {
    for (const char* policy : {"hold", "skip"}) {
        const auto outcome = run(
            {"run", at("fxaa.yaml"), "-i", in(), "-o", in(), "--frames", "5", "--missing", policy});
        EXPECT_EQ(outcome.code, 2) << outcome.text();
        EXPECT_TRUE(contains(outcome.err, in(5)) && contains(outcome.err, "frame of the input"));
        EXPECT_FALSE(exists(in(5)));
    }
    // A map beside the pictures that are compared.
    const auto map =
        run({"diff", in(), in(), "--map", at("in.%04d.exr"), "--on-existing", "overwrite"});
    EXPECT_EQ(map.code, 2) << map.text();
    const auto new_map = run({"diff", in(1), at("other.####.exr"), "--map", at("other.9999.exr")});
    EXPECT_EQ(new_map.code, 2) << new_map.text();
    EXPECT_FALSE(exists(at("other.9999.exr")));
}

TEST_F(ReplaceTest, TwoNamesOfOneFile) {
    const auto outcome = run({"diff", in(), in(), "--map", to("m.####.png"), "--map",
                              to("m.%04d.png"), "--on-existing", "overwrite"});
    EXPECT_EQ(outcome.code, 2) << outcome.text();
    EXPECT_TRUE(contains(outcome.err, "written twice")) << outcome.err;
    expect_remedy(outcome, "diff");
    EXPECT_TRUE(files().empty());
}

// With --on-error continue each frame is judged alone; inputs are not.
TEST_F(ReplaceTest, OnErrorContinue) {
    write_text(to("o.0001.exr.json"), kStranger);
    const Arguments command = {"run", at("fxaa.yaml"),  "-i",         in(),
                               "-o",  to("o.####.exr"), "--on-error", "continue"};
    const auto outcome = run(command);
    EXPECT_EQ(outcome.code, 1) << outcome.text();
    EXPECT_TRUE(read_text(to("o.0001.exr.json")) == kStranger);
    EXPECT_FALSE(exists(to("o.0001.exr")));
    EXPECT_TRUE(exists(to("o.0002.exr")));
    expect_remedy(outcome, "run");
    fresh();
    write_text(to("o.0001.exr.json"), kCamera);
    Arguments reads = command;
    reads.insert(reads.end(), {"--camera", to("o.0001.exr.json")});
    EXPECT_EQ(run(reads).code, 2);
    EXPECT_EQ(files().size(), 1u);
}

// A report has a folder of its own.
class ReplaceReportTest : public ReplaceTest {
  protected:
    Arguments ab(const std::string& folder = "r", const Arguments& more = {}) const {
        Arguments command = {"ab",
                             at("fxaa.yaml"),
                             at("motion_blur.yaml"),
                             "-i",
                             in(),
                             "-r",
                             in(),
                             "--frames",
                             "1",
                             "--repeats",
                             "1",
                             "-o",
                             to(folder)};
        command.insert(command.end(), more.begin(), more.end());
        return command;
    }
    Arguments bench(const Arguments& more = {}) const {
        Arguments command = {"bench",
                             at("fxaa.yaml"),
                             "-i",
                             in(),
                             "-r",
                             in(),
                             "--frames",
                             "1",
                             "--repeats",
                             "1",
                             "-o",
                             to("r"),
                             "--split-frames",
                             "0",
                             "--under",
                             "mse=1"};
        command.insert(command.end(), more.begin(), more.end());
        return command;
    }
    static Arguments with(Arguments command, const Arguments& more) {
        command.insert(command.end(), more.begin(), more.end());
        return command;
    }
    void mark(const std::string& folder) const {
        fs::create_directories(to(folder));
        write_text(to(folder + "/.postchain-report"), "This folder is a report of postchain.\n");
    }
    // Refused with this code, and nothing in w/ has changed.
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
    for (const char* file : {"index.html", "report.json", "report.csv", "report.md",
                             "images/input.0001.exr", "results/x.json", "under_mse.yaml"})
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
    // Bench goes on by itself.
    fresh();
    ASSERT_EQ(run(bench()).code, 0);
    EXPECT_TRUE(exists(to("r/under_mse.yaml")));
    EXPECT_EQ(run(bench()).code, 0);
    expect_refused(bench({"--on-existing", "fail"}), 5);
}

// Also one that a report does not hold: what is in its folder is removed with it.
TEST_F(ReplaceReportTest, NoInputLiesInTheFolder) {
    for (const char* file : {"report.json", "images/camera.json", "under_mse.yaml", "mine.json"})
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
    // The truth too, which is removed with the report.
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
    // Another report, the same folder: the first one's page would show its pictures.
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
}  // namespace postchain::test
