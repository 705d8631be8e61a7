// The process for previews ends with the service.
#include "tools/service/work/helper_process.h"

#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tools/service/work/preview_helper.h"

namespace postchain::service {
namespace {

TEST(PreviewProcess, IsNotWaitedForWhenTheServiceEnds) {
    const test::TempFolder folder;
    const std::string program = folder.path("program");
    std::ofstream(program) << "#!/bin/sh\nexec sleep 20\n";
    std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    ServiceSettings settings;
    settings.program = program;
    settings.store = folder.path("jobs.sqlite");
    settings.roots = test::must(Roots::of({folder.path()}));
    const std::atomic<bool> ends = true;
    PreviewHelper helper(settings, 0, ends);
    // After its 20 s it would be StatusCode::gl: the process has ended.
    EXPECT_EQ(helper.test().code(), StatusCode::canceled);
}

}  // namespace
}  // namespace postchain::service
