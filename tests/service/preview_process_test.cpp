// The process for previews ends with the service, and answers one task after the other.
#include "tools/service/work/previews.h"

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <future>
#include <set>
#include <string>

#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tools/service/work/service.h"

namespace postchain::service {
namespace {

class PreviewProcessTest : public testing::Test {
  protected:
    ServiceSettings running(const std::string& script) const {
        const std::string program = folder_.path("program");
        std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
        std::filesystem::permissions(program, std::filesystem::perms::owner_all);
        ServiceSettings settings;
        settings.preview_program = program;
        settings.roots = test::must(Roots::of({folder_.path()}));
        return settings;
    }
    test::TempFolder folder_;
};

TEST_F(PreviewProcessTest, IsNotWaitedForWhenTheServiceEnds) {
    const std::atomic<bool> ends = true;
    PreviewProcess process(running("exec sleep 20"), 0, ends);
    // After its 20 s it would be StatusCode::gl: the process has ended.
    EXPECT_EQ(process.test().status().code(), StatusCode::canceled);
}

// A preview may take longer than the patience with its thread, which another one then replaces.
TEST_F(PreviewProcessTest, AnswersOneTaskAfterTheOther) {
    const std::atomic<bool> ends = false;
    PreviewProcess process(running("read settings; i=0\n"
                                   "while read task; do\n"
                                   "  sleep 0.3; i=$((i + 1))\n"
                                   "  printf 'd\\003\\0\\0\\0\\0\\0\\0\\0no%d' $i\n"
                                   "done"),
                           0, ends);
    ASSERT_EQ(test::must(process.test()), "no1") << "it dies with the thread that started it";
    const auto test = [&] { return process.test(); };
    auto first = std::async(std::launch::async, test),
         second = std::async(std::launch::async, test);
    EXPECT_EQ((std::set{test::must(first.get()), test::must(second.get())}),
              (std::set<std::string>{"no2", "no3"}));
}

}  // namespace
}  // namespace postchain::service
