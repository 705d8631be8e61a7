// EXR output over its own input, and by several processes at once.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/io/written_files.h"
#include "tests/support/status.h"

namespace postchain::io {
namespace {

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
    enum Exit { kWritten, kSkipped, kExists, kOther };
    for (const auto& [policy, others] : {std::pair(OnExisting::fail, kExists),
                                         {OnExisting::skip, kSkipped},
                                         {OnExisting::overwrite, kWritten}}) {
        for (int round = 0; round < 4; ++round) {
            std::filesystem::remove(out);
            std::vector<pid_t> children;
            for (int c = 0; c < 4; ++c) {
                children.push_back(::fork());
                if (children.back() != 0) continue;
                const auto report = write(out, 7, policy);
                if (report.ok()) ::_exit(report->skipped ? kSkipped : kWritten);
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
