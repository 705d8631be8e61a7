// EXR output under difficulties: kills and races.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "tests/io/exr_files.h"
#include "tests/io/written_files.h"
#include "tests/support/status.h"
#include "tools/sequence/frame/frame_writer.h"

namespace postchain::io {
namespace {

using test::FilePart;
using test::must;
using test::TempFolder;
using testing::ElementsAre;

constexpr int kSide = 96;

// A frame whose color can be written repeatedly.
class OutputPath : public testing::Test {
  protected:
    void SetUp() override {
        FilePart part{.channels = {{"R"}, {"G"}, {"B"}, {"A"}, {"Z", Imf::FLOAT}},
                      .data = {{0, 0}, {kSide - 1, kSide - 1}}};
        test::write_file(input.path("in.exr"), {part});
    }
    InputFrame frame() { return read_ok(input.path("in.exr")); }
    Result<WriteReport> write(InputFrame& f, const std::string& path, float value,
                              OnExisting on_existing) {
        return write_filtered(path, f, ImageF(kSide, kSide, 4, value),
                              {.on_existing = on_existing});
    }
    // The value of all the file's color pixels; fails unless the file is complete.
    float value_of(const std::string& path) {
        const ImageF color = must(must(ExrFile::open(path)).read_channels(0, kRgba));
        for (const float v : color.data)
            if (v != color.data[0]) return -1;
        return color.data[0];
    }

    TempFolder input;
    TempFolder folder;
};

TEST_F(OutputPath, TheInputItselfMayBeOverwritten) {
    InputFrame f = frame();
    ASSERT_TRUE(write(f, input.path("in.exr"), 3, OnExisting::overwrite).ok());
    EXPECT_EQ(value_of(input.path("in.exr")), 3);
}

// Runs `body` in a child process. There must be no threads of the pool, which OpenImageIO may have
// started in another test: they would not exist in the child.
template <class Body>
pid_t start_child(Body body) {
    set_exr_threads(0);
    const pid_t child = ::fork();
    if (child == 0) ::_exit(body());
    return child;
}

int wait_for(pid_t child) {
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

TEST_F(OutputPath, KilledAtAnyMomentTheNameHoldsOldNewOrNothing) {
    const std::string path = folder.path("out.exr");
    int found = 0;
    for (int round = 0; round < 12; ++round) {
        if (round % 4 == 0) std::filesystem::remove(path);
        int written[2];
        ASSERT_EQ(::pipe(written), 0);
        const pid_t child = start_child([&] {
            InputFrame f = frame();
            for (int n = 0;; ++n) {
                const float value = float(round * 64 + n % 64);
                if (!write(f, path, value, OnExisting::overwrite).ok()) return 1;
                if (n == 0 && ::write(written[1], "x", 1) != 1) return 2;
            }
        });
        ::close(written[1]);
        // However slow the disk is, half of the children have written.
        char one = 0;
        if (round % 2) {
            EXPECT_EQ(::read(written[0], &one, 1), 1) << "the child has ended";
        }
        std::this_thread::sleep_for(std::chrono::microseconds(3000 + round * 1700));
        ::kill(child, SIGKILL);
        ::close(written[0]);
        EXPECT_EQ(wait_for(child), 1000 + SIGKILL);
        if (std::filesystem::exists(path)) {
            ++found;
            EXPECT_GE(value_of(path), 0);
        }
    }
    EXPECT_GE(found, 6);
}

TEST_F(OutputPath, TwoProcessesAtOneOutput) {
    for (const OnExisting policy : {OnExisting::fail, OnExisting::skip, OnExisting::overwrite}) {
        for (int round = 0; round < 4; ++round) {
            const std::string path = folder.path("out.exr");
            std::filesystem::remove(path);
            // 0 written, 1 skipped, 2 failed because it exists.
            std::vector<pid_t> children;
            for (int c = 0; c < 4; ++c)
                children.push_back(start_child([&] {
                    InputFrame f = frame();
                    const auto report = write(f, path, 7, policy);
                    if (report.ok()) return report->skipped ? 1 : 0;
                    return report.status().message().find("exists already") != std::string::npos
                               ? 2
                               : 3;
                }));
            std::vector<int> results;
            for (const pid_t child : children) results.push_back(wait_for(child));
            std::sort(results.begin(), results.end());
            const int others = policy == OnExisting::fail ? 2 : policy == OnExisting::skip ? 1 : 0;
            EXPECT_THAT(results, ElementsAre(0, others, others, others));
            EXPECT_EQ(value_of(path), 7);
            EXPECT_THAT(folder.names(), ElementsAre("out.exr"));
        }
    }
}

}  // namespace
}  // namespace postchain::io
