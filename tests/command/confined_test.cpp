// A confined process reads its folders, and does nothing else.
#include "tools/apps/common/confine.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "tests/support/temp_folder.h"

namespace postchain {
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

// FOLDER/own/a, FOLDER/written/c and FOLDER/other/b. One thread is confined, which ends with the
// test.
class Confined : public testing::Test {
  protected:
    void SetUp() override {
        if (landlock_version() == 0) GTEST_SKIP() << "skipped: the kernel has no Landlock";
        for (const char* name : {"own", "written", "other"})
            std::filesystem::create_directory(folder_.path(name));
        std::ofstream(a_) << "a";
        std::ofstream(b_) << "b";
        std::ofstream(c_) << "c";
    }
    void confined(const std::function<void()>& what) {
        std::thread([&] {
            const Status status = confine(
                {{folder_.path("own"), "/dev/zero"}, {folder_.path("written")}, {"/dev/null"}});
            ASSERT_TRUE(status.ok()) << status.message();
            what();
        }).join();
    }

    test::TempFolder folder_;
    const std::string a_ = folder_.path("own/a"), b_ = folder_.path("other/b"),
                      c_ = folder_.path("written/c");
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

TEST_F(Confined, WritesWhereItMay) {
    const std::string below = folder_.path("written/below"), file = below + "/new";
    confined([&] {
        EXPECT_EQ(fault_of(::mkdir(below.c_str(), 0700)), 0);
        EXPECT_EQ(opening(file, O_WRONLY | O_CREAT | O_EXCL), 0);
        EXPECT_EQ(fault_of(::rename(file.c_str(), (file + "er").c_str())), 0);
        EXPECT_EQ(opening(c_, O_WRONLY | O_TRUNC), 0);
        EXPECT_EQ(fault_of(::unlink(c_.c_str())), 0);
        EXPECT_EQ(fault_of(::symlink(b_.c_str(), c_.c_str())), EACCES);
        EXPECT_NE(fault_of(::link(b_.c_str(), c_.c_str())), 0);
    });
}

TEST_F(Confined, HasNoNetwork) {
    const auto socket_of = [](int family) {
        const int file = ::socket(family, SOCK_DGRAM, 0);
        const int fault = fault_of(file);
        if (file >= 0) ::close(file);
        return fault;
    };
    confined([&] {
        for (const int family : {AF_INET, AF_INET6, AF_NETLINK})
            EXPECT_EQ(socket_of(family), EACCES) << family;
        EXPECT_EQ(socket_of(AF_UNIX), 0);
        EXPECT_EQ(fault_of(int(::syscall(SYS_io_uring_setup, 1, nullptr))), ENOSYS);
    });
    EXPECT_EQ(socket_of(AF_INET), 0) << "another thread";
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

}  // namespace
}  // namespace postchain
