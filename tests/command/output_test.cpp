// Unwritable places: exit code 5 with the reason, and no partial files.
#include <sched.h>
#include <sys/mount.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>

#include "tests/command/fixture.h"

namespace postchain::test::output_test {
namespace {

namespace fs = std::filesystem;
using OutputTest = CommandTest;

Outcome to(const CommandTest&, const std::string& chain, const std::string& in,
           const std::string& out, const Arguments& more = {}, const Launch& launch = {}) {
    Arguments arguments = {"run", chain, "-i", in, "-o", out};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run(arguments, launch);
}

TEST_F(OutputTest, FolderThatIsNotThere) {
    write_sequence(at(""), {1});
    const auto outcome = to(*this, at("fxaa.yaml"), in(), at("nowhere/deep/o.####.exr"));
    EXPECT_EQ(outcome.code, 5) << outcome.text();
    EXPECT_TRUE(contains(outcome.err, at("nowhere/deep")) && contains(outcome.err, "not exist"));
    EXPECT_FALSE(exists(at("nowhere")));
}

TEST_F(OutputTest, FileWhereAFolderShouldBe) {
    write_sequence(at(""), {1});
    write_text(at("file"), "kept");
    for (const char* name : {"file/o.####.exr", "file/deep/o.####.exr"}) {
        const auto outcome = to(*this, at("fxaa.yaml"), in(), at(name));
        EXPECT_EQ(outcome.code, 5) << outcome.text();
        EXPECT_TRUE(contains(outcome.err, at("file"))) << outcome.err;
    }
    EXPECT_EQ(read_text(at("file")), "kept");
    const auto stages = filter("fxaa", {"--dump-stages", at("file")});
    EXPECT_EQ(stages.code, 5) << stages.text();
    EXPECT_TRUE(contains(stages.err, at("file"))) << stages.err;
    EXPECT_TRUE(outputs().empty());
}

TEST_F(OutputTest, FolderWhereTheFileShouldBe) {
    write_sequence(at(""), {1});
    fs::create_directory(out(1));
    for (const char* policy : {"fail", "skip", "overwrite"}) {
        const auto outcome = filter("fxaa", {"--on-existing", policy});
        EXPECT_EQ(outcome.code, 5) << policy << outcome.text();
        EXPECT_TRUE(contains(outcome.err, out(1))) << outcome.err;
    }
    EXPECT_TRUE(fs::is_directory(out(1)));
}

// The size limit moves through header, pixels and sidecar.
TEST_F(OutputTest, DiskFullByAFileSizeLimit) {
    write_sequence(at(""), {1});
    ASSERT_EQ(filter("fxaa").code, 0);
    const long whole = long(fs::file_size(out(1)));
    write_text(out(1), "old");
    for (long bytes : {0L, 10L, 1000L, whole / 2, whole - 1}) {
        // Even an empty program writes a file before main with the thread sanitizer.
        if (POSTCHAIN_SANITIZED && bytes == 0) continue;
        Launch launch;
        launch.file_bytes = bytes;
        launch.stdout_path = "/dev/null";
        // Captured stderr is a file too; the shader cache must not matter either.
        launch.close_stderr = bytes < 1000;
        const auto outcome = filter("fxaa", {"--on-existing", "overwrite"}, launch);
        EXPECT_EQ(outcome.code, 5) << bytes << outcome.text();
        EXPECT_EQ(outcome.signal, 0);
        if (!launch.close_stderr) {
            EXPECT_TRUE(contains(outcome.err, "file-size limit")) << outcome.err;
            EXPECT_TRUE(contains(outcome.err, out(1))) << outcome.err;
        }
        EXPECT_TRUE(read_text(out(1)) == "old") << "the old file is lost";
        EXPECT_EQ(temporaries(at("out")), std::vector<std::string>());
    }
}

// A file system of 64 KiB, in a mount namespace of this process. If the system forbids it (not
// root; in a chroot, whose root is not a mount point), the file-size limit above covers the case.
TEST_F(OutputTest, DiskFullOnASmallFileSystem) {
    write_sequence(at(""), {1, 2, 3}, 96, 64);
    ASSERT_EQ(filter("fxaa", {"--frames", "1"}).code, 0);
    ASSERT_GT(fs::file_size(out(1)), 45u * 1024);
    fs::create_directory(at("small"));
    if (unshare(CLONE_NEWNS) != 0 ||
        mount("none", "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0 ||
        mount("tmpfs", at("small").c_str(), "tmpfs", 0, "size=64k") != 0) {
        ASSERT_TRUE(errno == EPERM || errno == EACCES || errno == EINVAL) << errno;
        RecordProperty("small_file_system", "not permitted here");
        return;
    }
    const auto outcome =
        to(*this, at("fxaa.yaml"), in(), at("small/o.####.exr"), {"--on-error", "continue"});
    EXPECT_EQ(outcome.code, 1) << outcome.text();
    EXPECT_TRUE(contains(outcome.err, "disk full")) << outcome.err;
    // The first output fits, the others do not; existing files are complete.
    EXPECT_EQ(read_color(at("small/o.0001.exr")).data, read_color(out(1)).data);
    EXPECT_FALSE(exists(at("small/o.0002.exr")));
    EXPECT_EQ(temporaries(at("small")), std::vector<std::string>());
    const auto stopped = to(*this, at("fxaa.yaml"), in(2), at("small/p.exr"));
    EXPECT_EQ(stopped.code, 5) << stopped.text();
    umount2(at("small").c_str(), MNT_DETACH);
}

TEST_F(OutputTest, NameThatIsTooLong) {
    write_sequence(at(""), {1});
    const auto outcome =
        to(*this, at("fxaa.yaml"), in(), at("out/" + std::string(300, 'n') + ".####.exr"));
    EXPECT_EQ(outcome.code, 5) << outcome.text().substr(0, 500);
}

TEST_F(OutputTest, StdoutThatIsFullOrClosed) {
    write_sequence(at(""), {1});
    Launch full;
    full.stdout_path = "/dev/full";
    Launch closed;
    closed.close_stdout = true;
    for (const Launch& launch : {full, closed}) {
        for (const Arguments& arguments : {Arguments{"passes"},
                                           {"schema"},
                                           {"man"},
                                           {"info"},
                                           {"--help"},
                                           {"--version"},
                                           {"inspect", in(1)},
                                           {"plan", at("fxaa.yaml"), "-i", in(1)}}) {
            const auto outcome = run(arguments, launch);
            EXPECT_EQ(outcome.code, 5) << arguments[0] << outcome.text();
            EXPECT_TRUE(contains(outcome.err, "stdout")) << outcome.err;
        }
        const auto outcome = filter("fxaa", {"--json", "--on-existing", "overwrite"}, launch);
        EXPECT_EQ(outcome.code, 5) << outcome.text();
        EXPECT_FALSE(read_color(out(1)).empty());
    }
    // Without --json nothing is printed on stdout, so closing it does not matter.
    const auto silent = filter("fxaa", {"--on-existing", "overwrite"}, closed);
    EXPECT_EQ(silent.code, 0) << silent.text();
    // No message may end up in an image.
    Launch blind = closed;
    blind.close_stderr = true;
    EXPECT_EQ(filter("fxaa", {"--on-existing", "overwrite"}, blind).code, 0);
    EXPECT_FALSE(read_color(out(1)).empty());
}

TEST_F(OutputTest, ReaderOfThePipeGoesAway) {
    write_sequence(at(""), {1, 2, 3});
    const std::string command = std::string(POSTCHAIN_COMMAND) + " run " + at("fxaa.yaml") +
                                " -i '" + in() + "' -o '" + out() +
                                "' --json | true; "
                                "exit ${PIPESTATUS[0]}";
    const auto outcome = run_program({"bash", "-c", command});
    EXPECT_EQ(outcome.signal, 0);
    EXPECT_TRUE(outcome.code == 0 || outcome.code == 5) << outcome.text();
    EXPECT_EQ(outputs().size(), 3u) << outcome.text();
}

}  // namespace
}  // namespace postchain::test::output_test
