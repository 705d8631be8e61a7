// A confined process reads its folders, and does nothing else. The process for previews ends with
// the service.
#include "tools/service/work/helper_process.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/status.h"
#include "tests/support/temp_folder.h"
#include "tools/service/work/preview_helper.h"

namespace postchain::service {
namespace {

// 0 or the reason of a failure.
int fault_of(int result) {
    return result < 0 ? errno : 0;
}
int opening(const std::string& path, int flags) {
    const int file = ::open(path.c_str(), flags, 0600);
    const int fault = fault_of(file);
    if (file >= 0) ::close(file);
    return fault;
}
int device_control(const std::string& path) {
    termios unused = {};
    const int file = ::open(path.c_str(), O_RDONLY);
    const int fault = fault_of(::ioctl(file, TCGETS, &unused));
    ::close(file);
    return fault;
}

// FOLDER/own/a and FOLDER/other/b. Landlock confines one thread, which ends with the test.
class Confined : public testing::Test {
  protected:
    void SetUp() override {
        if (landlock_version() == 0) GTEST_SKIP() << "skipped: the kernel has no Landlock";
        for (const char* name : {"own", "other"})
            std::filesystem::create_directory(folder_.path(name));
        std::ofstream(a_) << "a";
        std::ofstream(b_) << "b";
    }
    void confined(const std::function<void()>& what) {
        std::thread([&] {
            const Status status = confine_helper({folder_.path("own"), "/dev/zero"}, {"/dev/null"});
            ASSERT_TRUE(status.ok()) << status.message();
            what();
        }).join();
    }

    test::TempFolder folder_;
    const std::string a_ = folder_.path("own/a"), b_ = folder_.path("other/b");
    const std::string made_ = folder_.path("own/made");
};

TEST_F(Confined, ReadsItsFoldersAndNoOthers) {
    confined([&] {
        EXPECT_EQ(opening(a_, O_RDONLY), 0);
        EXPECT_EQ(opening(folder_.path("own"), O_RDONLY | O_DIRECTORY), 0);
        EXPECT_EQ(opening("/proc/self/exe", O_RDONLY), 0) << "the system";
        EXPECT_EQ(opening(b_, O_RDONLY), EACCES);
        EXPECT_EQ(opening(folder_.path("other"), O_RDONLY | O_DIRECTORY), EACCES);
        EXPECT_EQ(opening(folder_.path("own/../other/b"), O_RDONLY), EACCES);
    });
    EXPECT_EQ(opening(b_, O_RDONLY), 0) << "another thread";
}

// As an installation has them: modules in lib, tables in share.
TEST_F(Confined, ReadsTheFoldersBesideItsProgram) {
    namespace fs = std::filesystem;
    const fs::path above = fs::read_symlink("/proc/self/exe").parent_path().parent_path();
    std::vector<fs::path> made;
    for (const char* name : {"lib", "share"})
        if (fs::create_directory(above / name)) made.push_back(above / name);
    confined([&] {
        for (const char* name : {"lib", "share"})
            EXPECT_EQ(opening(above / name, O_RDONLY | O_DIRECTORY), 0) << name;
    });
    for (const fs::path& folder : made) fs::remove(folder);
}

TEST_F(Confined, WritesNothing) {
    confined([&] {
        EXPECT_EQ(opening(made_, O_WRONLY | O_CREAT), EACCES);
        EXPECT_EQ(opening(a_, O_WRONLY), EACCES);
        EXPECT_EQ(fault_of(::rename(a_.c_str(), made_.c_str())), EACCES);
        EXPECT_EQ(fault_of(::unlink(a_.c_str())), EACCES);
        EXPECT_EQ(fault_of(::mkdir(made_.c_str(), 0700)), EACCES);
        EXPECT_EQ(fault_of(::symlink(a_.c_str(), made_.c_str())), EACCES);
        EXPECT_NE(fault_of(::link(b_.c_str(), made_.c_str())), 0);
        EXPECT_NE(fault_of(::rename(b_.c_str(), made_.c_str())), 0);
        if (landlock_version() < 3) return;
        EXPECT_EQ(fault_of(::truncate(a_.c_str(), 0)), EACCES);
        EXPECT_EQ(opening(a_, O_RDONLY | O_TRUNC), EACCES);
    });
    EXPECT_EQ(std::filesystem::file_size(a_), 1u);
}

TEST_F(Confined, UsesTheDevicesThatItIsGiven) {
    confined([] {
        EXPECT_EQ(opening("/dev/null", O_RDWR), 0);
        EXPECT_EQ(opening("/dev/full", O_RDONLY), EACCES);
        EXPECT_EQ(opening("/dev/zero", O_WRONLY), EACCES);
        EXPECT_EQ(device_control("/dev/null"), ENOTTY) << "it reaches the device";
        if (landlock_version() >= 5) {
            EXPECT_EQ(device_control("/dev/zero"), EACCES);
        }
    });
}

TEST_F(Confined, SendsNoSignalToItsParent) {
    if (landlock_version() < 6) GTEST_SKIP() << "skipped: Landlock of this kernel has no signals";
    EXPECT_EQ(fault_of(::kill(::getppid(), 0)), 0);
    confined([] { EXPECT_EQ(fault_of(::kill(::getppid(), 0)), EPERM); });
}

TEST(Devices, SharedMemoryIsNone) {
    const auto devices = devices_of_system();
    const auto has = [&](const char* path) {
        return std::find(devices.begin(), devices.end(), path) != devices.end();
    };
    EXPECT_TRUE(has("/dev/null"));
    EXPECT_FALSE(has("/dev/shm"));
}

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
