// Replacing files: never inputs, other existing files as --on-existing allows.
#include "tools/sequence/files/output_files.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "chain/base/stop.h"
#include "tests/io/exr_files.h"
#include "tests/io/written_files.h"
#include "tests/support/status.h"

namespace postchain::io {
namespace {

namespace fs = std::filesystem;
using test::TempFolder;
using testing::AllOf;
using testing::HasSubstr;

class OutputFilesTest : public testing::Test {
  protected:
    std::string at(const std::string& name) const { return folder_.path(name); }
    void make(const std::string& name) const { std::ofstream(at(name)) << name; }
    PathPattern pattern(const std::string& name) const { return *PathPattern::parse(at(name)); }
    static OutputFile output(const std::string& path) {
        return {path, "the output", "name another with {output}"_keyed};
    }
    // One input pattern in.####.exr with frames 1 and 2, the camera file, and this output.
    OutputFiles files(const std::string& path, OnExisting on_existing = OnExisting::overwrite) {
        make("in.0001.exr");
        make("in.0002.exr");
        make("camera.json");
        OutputFiles all(on_existing, "skip or overwrite");
        all.read(pattern("in.####.exr"), "the input");
        all.read({at("camera.json"), "the camera file"});
        all.write(output(path));
        return all;
    }
    TempFolder folder_;
};

TEST_F(OutputFilesTest, AnInputIsItselfUnderEveryName) {
    fs::create_directories(at("a/b"));
    make("camera.json");
    fs::create_hard_link(at("camera.json"), at("a/hard.exr"));
    fs::create_symlink(at("camera.json"), at("a/soft.exr"));
    fs::create_symlink("soft.exr", at("a/softer.exr"));
    fs::create_directory_symlink(folder_.path(), at("a/folder"));
    for (const char* name :
         {"camera.json", "./camera.json", "a/../camera.json", "a//../camera.json", "a/hard.exr",
          "a/soft.exr", "a/softer.exr", "a/folder/camera.json"})
        for (const auto choice : {OnExisting::fail, OnExisting::skip, OnExisting::overwrite}) {
            const Status status = files(folder_.path() + "/" + name, choice).check();
            EXPECT_EQ(status.code(), StatusCode::usage) << name;
            EXPECT_THAT(status.message(),
                        AllOf(HasSubstr(name), HasSubstr("the output would replace"),
                              HasSubstr("the camera file"), HasSubstr("{output}"_keyed)));
        }
    EXPECT_EQ(files(at("in.0002.exr")).check().code(), StatusCode::usage);
    EXPECT_TRUE(files(at("a/folder/free.exr")).check().ok());
}

TEST_F(OutputFilesTest, AFolderIsMadeWithThoseAboveIt) {
    for (int i = 0; i < 2; ++i) EXPECT_TRUE(make_folder(at("new/deep")).ok());
    EXPECT_TRUE(fs::is_directory(at("new/deep")));
    make("file");
    for (const auto* name : {"file", "file/deep"}) {
        const Status status = make_folder(at(name));
        EXPECT_EQ(status.code(), StatusCode::output) << name;
        EXPECT_THAT(status.message(),
                    AllOf(HasSubstr(at(name)), HasSubstr("choose another folder")));
    }
}

// A folder mounted a second time has other paths, and the same files.
TEST_F(OutputFilesTest, AFolderMountedTwiceIsOneFolder) {
    fs::create_directories(at("frames/deep"));
    fs::create_directories(at("mounted"));
    make("frames/in.0001.exr");
    make("frames/deep/camera.json");
    // In a child with mounts of its own. 77: mounting is not permitted here.
    const pid_t child = ::fork();
    if (child == 0) {
        if (::unshare(CLONE_NEWNS) != 0 ||
            ::mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
            ::mount(at("frames").c_str(), at("mounted").c_str(), nullptr, MS_BIND, nullptr) != 0)
            ::_exit(77);
        int faults = 0;
        const auto expect = [&](bool good, const char* what) {
            if (!good) ::fprintf(stderr, "%s\n", what);
            faults += !good;
        };
        const auto both = [&](const std::string& first, const std::string& second) {
            OutputFiles all(OnExisting::overwrite);
            all.write(output(at(first)));
            all.write(output(at(second)));
            return all.check().ok();
        };
        OutputFiles frame(OnExisting::overwrite), folder = frame;
        frame.read(pattern("frames/in.####.exr"), "the input");
        frame.write(output(at("mounted/in.0007.exr")));
        expect(!frame.check().ok(), "one more frame of the input");
        expect(!both("frames/o.exr", "mounted/o.exr"), "written twice");
        expect(!both("frames/deep/o.exr", "mounted/deep/o.exr"), "written twice, below");
        expect(!both("frames/new/o.exr", "mounted/new/o.exr"), "written twice, to be made");
        expect(both("frames/o.exr", "mounted/p.exr"), "two files");
        folder.read({at("frames/deep/camera.json"), "the camera file"});
        folder.write(OutputFolder{at("mounted"), "a report", "mark", "me", "choose another"});
        expect(!folder.check_names().ok(), "the folder of an input");
        ::_exit(faults);
    }
    int status = 0;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFEXITED(status));
    if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "skipped: mounting is not permitted";
    EXPECT_EQ(WEXITSTATUS(status), 0);
}

// The name of a shipped chain looks like a file in the working folder.
TEST_F(OutputFilesTest, WhatIsNotThereIsNotRead) {
    fs::create_directory(at("report"));
    OutputFiles all;
    all.read({at("report/balanced"), "the chain file"});
    all.write(OutputFolder{at("report"), "a report", "mark", "owner", "name another"});
    EXPECT_TRUE(all.check().ok()) << all.check().message();
    make("report/balanced");
    all.read({at("report/balanced"), "the chain file"});
    EXPECT_EQ(all.check().code(), StatusCode::usage);
}

TEST_F(OutputFilesTest, RelativeNamesAreThoseOfTheWorkingFolder) {
    const fs::path before = fs::current_path();
    fs::current_path(folder_.path());
    EXPECT_EQ(files("camera.json").check().code(), StatusCode::usage);
    EXPECT_EQ(files("nowhere/../in.0001.exr").check().code(), StatusCode::usage);
    EXPECT_TRUE(files("free.exr").check().ok());
    fs::current_path(before);
}

TEST_F(OutputFilesTest, APatternThatIsReadGetsNoFurtherFile) {
    const Status status = files(at("in.0003.exr")).check();
    EXPECT_EQ(status.code(), StatusCode::usage);
    EXPECT_THAT(status.message(),
                AllOf(HasSubstr("one more frame of the input"), HasSubstr("in.####.exr")));
    fs::create_directory(at("b"));
    for (const char* name : {"in.3.exr", "in.00003.exr", "in.0003.exr.json", "b/in.0003.exr"})
        EXPECT_TRUE(files(at(name)).check().ok()) << name;
}

TEST_F(OutputFilesTest, NothingIsWrittenTwice) {
    OutputFiles all = files(at("o.exr"));
    all.write(OutputFile{folder_.path() + "//./o.exr", "the error map", "name another with --map"});
    const Status status = all.check();
    EXPECT_EQ(status.code(), StatusCode::usage);
    EXPECT_THAT(status.message(), AllOf(HasSubstr("o.exr"), HasSubstr("the output"),
                                        HasSubstr("the error map"), HasSubstr("--map")));
}

TEST_F(OutputFilesTest, WhatIsThereIsReplacedAsItIsSaid) {
    make("o.exr");
    const Status status = files(at("o.exr"), OnExisting::fail).check();
    EXPECT_EQ(status.code(), StatusCode::output);
    EXPECT_THAT(status.message(), AllOf(HasSubstr("o.exr: exists"), HasSubstr("the output"),
                                        HasSubstr("{on_existing=skip or overwrite}"_keyed)));
    for (const auto choice : {OnExisting::skip, OnExisting::overwrite}) {
        EXPECT_TRUE(files(at("o.exr"), choice).check().ok());
        EXPECT_EQ(*files(at("o.exr"), choice).permit(at("./o.exr")), OnExisting::overwrite);
    }
    EXPECT_EQ(*files(at("o.exr"), OnExisting::fail).permit(at("o.exr")), OnExisting::fail);
    EXPECT_EQ(*files(at("o.exr")).permit(at("p.exr")), OnExisting::fail);  // not an output
    // A dangling link takes the name too, and a folder.
    fs::create_symlink(at("nowhere"), at("link.exr"));
    EXPECT_EQ(files(at("link.exr"), OnExisting::fail).check().code(), StatusCode::output);
    fs::create_directory(at("folder.exr"));
    EXPECT_EQ(files(at("folder.exr")).check().code(), StatusCode::output);
    // Only one frame's.
    OutputFiles all = files(at("free.exr"), OnExisting::fail);
    all.write(output(at("o.exr")));
    EXPECT_TRUE(all.check_existing({at("free.exr")}).ok());
    EXPECT_FALSE(all.check_existing({at("free.exr"), at("o.exr")}).ok());
}

// A name for which its temporary, or its sidecar's, would be too long.
TEST_F(OutputFilesTest, TheLongestNames) {
    const auto status = [&](size_t bytes) {
        return files(at(std::string(bytes, 'o'))).check_names();
    };
    EXPECT_TRUE(status(242).ok());
    EXPECT_EQ(status(243).code(), StatusCode::usage);
    EXPECT_THAT(status(243).message(),
                HasSubstr("o: the name of the output has 243 bytes, more than 242; name another"));
    std::string deep = at("");
    while (deep.size() < 4000) deep += "dd/";
    const auto below = [&](size_t bytes) {
        return files(deep + std::string(bytes - deep.size(), 'o')).check_names();
    };
    EXPECT_TRUE(below(4082).ok());
    EXPECT_THAT(below(4083).message(), HasSubstr("the path of the output has 4083 bytes"));
}

TEST_F(OutputFilesTest, StoppedChecksEnd) {
    make("o.exr");
    const OutputFiles clash = files(at("camera.json")),
                      taken = files(at("o.exr"), OnExisting::fail);
    const std::atomic<bool> stop = true;
    const StopFlag scope(&stop);
    EXPECT_EQ(clash.check_names().code(), StatusCode::internal);
    EXPECT_EQ(taken.check_existing().code(), StatusCode::internal);
}

// A file may become an input between the check and the write.
TEST_F(OutputFilesTest, PermissionIsAskedAgain) {
    const OutputFiles all = files(at("o.exr"));
    ASSERT_TRUE(all.check().ok());
    fs::create_hard_link(at("in.0001.exr"), at("o.exr"));
    EXPECT_EQ(all.permit(at("o.exr")).status().code(), StatusCode::usage);
}

TEST_F(OutputFilesTest, AFamilyIsKnownByItsNames) {
    const auto with = [&](OnExisting choice) {
        OutputFiles all = files(at("o.exr"), choice);
        all.write(OutputFamily{folder_.path() + "/.",
                               [](const std::string& name) { return name.starts_with("0."); },
                               "a stage", "name another folder with {dump_stages}"_keyed});
        return all;
    };
    EXPECT_TRUE(with(OnExisting::fail).check().ok());
    EXPECT_EQ(*with(OnExisting::overwrite).permit(at("0.a")), OnExisting::overwrite);
    EXPECT_EQ(*with(OnExisting::overwrite).permit(at("1.a")), OnExisting::fail);
    make("0.a");
    const Status status = with(OnExisting::fail).check();
    EXPECT_EQ(status.code(), StatusCode::output);
    EXPECT_THAT(status.message(), AllOf(HasSubstr("0.a: exists"), HasSubstr("a stage"),
                                        HasSubstr("{dump_stages}"_keyed)));
    EXPECT_TRUE(with(OnExisting::overwrite).check().ok());
    // An input with such a name, also through a link; and another output.
    OutputFiles read = with(OnExisting::overwrite), twice = read;
    read.read({at("0.a"), "the profile"});
    EXPECT_EQ(read.check().code(), StatusCode::usage);
    twice.write(output(at("0.b")));
    EXPECT_EQ(twice.check().code(), StatusCode::usage);
    fs::remove(at("0.a"));
    fs::create_symlink(at("in.0001.exr"), at("0.a"));
    EXPECT_EQ(with(OnExisting::overwrite).check().code(), StatusCode::usage);
}

TEST_F(OutputFilesTest, AFolderHasOneOwner) {
    const auto with = [&](const std::string& owner, OnExisting choice = OnExisting::overwrite) {
        OutputFiles all = files(at("o.exr"), choice);
        all.write(OutputFolder{at("r"), "a report", ".mark", owner + "\n",
                               "name another folder with {output}"_keyed});
        return all;
    };
    const auto with_input = [&](const std::string& input) {
        OutputFiles all = with("me");
        all.read({at(input), "the truth"});
        return all.check();
    };
    ASSERT_TRUE(with("me", OnExisting::fail).check().ok());
    ASSERT_TRUE(with("me", OnExisting::fail).make_folders().ok());
    EXPECT_TRUE(fs::exists(at("r/.mark")));
    EXPECT_TRUE(with("me", OnExisting::fail).check().ok()) << "nothing but the mark";
    EXPECT_EQ(*with("me").permit(at("r/deep/a")), OnExisting::overwrite);
    EXPECT_EQ(*with("me").permit(at("rr")), OnExisting::fail);
    make("r/a");
    EXPECT_THAT(with("me", OnExisting::fail).check().message(),
                HasSubstr("has a report already; choose {on_existing=skip or overwrite}"_keyed));
    EXPECT_TRUE(with("me").check().ok());
    for (const auto choice : {OnExisting::fail, OnExisting::skip, OnExisting::overwrite})
        EXPECT_EQ(with("you", choice).check().code(), StatusCode::output);
    // Also through a link: its target would be removed with the folder.
    fs::create_symlink(at("r/a"), at("link.exr"));
    for (const char* input : {"r/a", "link.exr"}) {
        EXPECT_EQ(with_input(input).code(), StatusCode::usage) << input;
        EXPECT_THAT(with_input(input).message(), HasSubstr("the truth"));
    }
    fs::remove(at("r/.mark"));
    EXPECT_THAT(with("me").check().message(), HasSubstr("not empty and is not a report"));
    make("file");
    OutputFiles on_file;
    on_file.write(OutputFolder{at("file"), "a report", ".mark", "me\n", "name another"});
    EXPECT_EQ(on_file.check().code(), StatusCode::output);
}

// One process was killed before it had renamed the mark, others while they wrote a file.
TEST_F(OutputFilesTest, WhatKillsLeaveIsInNoOnesWay) {
    OutputFiles all = files(at("o.exr"), OnExisting::fail);
    all.write(OutputFolder{at("r"), "a report", ".mark", "me\n", "name another"});
    all.write(OutputFamily{folder_.path(), [](const auto& name) { return name == "0.a"; },
                           "a stage", "name another"});
    fs::create_directories(at("r/images"));
    make("r/..mark.77.tmp");
    fs::remove(at("r/images"));
    EXPECT_TRUE(all.check().ok()) << all.check().message();
    fs::create_directories(at("r/images"));
    EXPECT_EQ(all.check().code(), StatusCode::output) << "a folder of someone else";
    for (const char* name : {".o.exr.77.tmp", ".0.a.77.tmp", "r/images/.x.exr.77.tmp"}) make(name);
    for (const char* name : {".other.exr.77.tmp", "r/images/x.exr"}) make(name);
    all.remove_left_temporaries();
    for (const char* name :
         {".o.exr.77.tmp", ".0.a.77.tmp", "r/images/.x.exr.77.tmp", "r/..mark.77.tmp"})
        EXPECT_FALSE(fs::exists(at(name))) << name;
    for (const char* name : {".other.exr.77.tmp", "r/images/x.exr", "in.0001.exr"})
        EXPECT_TRUE(fs::exists(at(name))) << name;
}

// EXR output over its own input, and by several processes at once.

using test::must;
using testing::Each;
using testing::ElementsAre;

class OutputPath : public InOut {
  protected:
    void SetUp() override {
        test::FilePart part = test::rgba_z();
        part.data = {{0, 0}, {95, 95}};  // takes long enough for the processes to meet
        test::write_file(in, {part});
    }
    Result<WriteReport> write(const std::string& path, float value, OnExisting on_existing) {
        ReadFile frame = read_ok(in);
        const ImageF color(frame.window.width(), frame.window.height(), 4, value);
        return write_filtered(path, frame, color, {.on_existing = on_existing});
    }
    std::vector<float> values_of(const std::string& path) {
        return must(must(ExrFile::open(path)).read_channels(0, kRgba)).data;
    }
};

TEST_F(OutputPath, TheInputItselfMayBeOverwritten) {
    ASSERT_TRUE(write(in, 3, OnExisting::overwrite).ok());
    EXPECT_THAT(values_of(in), Each(3));
}

TEST_F(OutputPath, TwoProcessesAtOneOutput) {
    // There must be no threads of the pool, which another test may have started: they would not
    // exist in the child.
    set_exr_threads(0);
    enum Exit { kWritten, kExists, kOther };
    for (const auto& [policy, others] : {std::pair(OnExisting::fail, kExists),
                                         {OnExisting::skip, kWritten},
                                         {OnExisting::overwrite, kWritten}}) {
        for (int round = 0; round < 4; ++round) {
            std::filesystem::remove(out);
            std::vector<pid_t> children;
            for (int c = 0; c < 4; ++c) {
                children.push_back(::fork());
                if (children.back() != 0) continue;
                const auto report = write(out, 7, policy);
                if (report.ok()) ::_exit(kWritten);
                const bool exists =
                    report.status().message().find("exists already") != std::string::npos;
                ::_exit(exists ? kExists : kOther);
            }
            std::vector<int> results;
            for (const pid_t child : children) {
                int status = 0;
                ::waitpid(child, &status, 0);
                results.push_back(WIFEXITED(status) ? WEXITSTATUS(status) : kOther);
            }
            std::sort(results.begin(), results.end());
            EXPECT_THAT(results, ElementsAre(kWritten, others, others, others));
            EXPECT_THAT(values_of(out), Each(7));
            EXPECT_THAT(folder.names(), ElementsAre("in.exr", "out.exr"));
        }
    }
}

}  // namespace
}  // namespace postchain::io
