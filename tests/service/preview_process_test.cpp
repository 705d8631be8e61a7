// The process for previews ends with the service.
#include "tools/service/work/previews.h"

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tools/service/work/service.h"

namespace postchain::service {
namespace {

TEST(PreviewProcessTest, IsNotWaitedForWhenTheServiceEnds) {
    const test::TempFolder folder;
    const std::string program = folder.path("program");
    std::ofstream(program) << "#!/bin/sh\nexec sleep 20\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    ServiceSettings settings;
    settings.preview_program = program;
    settings.roots = test::must(Roots::of({folder.path()}));
    const std::atomic<bool> ends = true;
    PreviewProcess process(settings, 0, ends);
    // After its 20 s it would be StatusCode::gl: the process has ended.
    EXPECT_EQ(process.test().status().code(), StatusCode::canceled);
}

}  // namespace
}  // namespace postchain::service
