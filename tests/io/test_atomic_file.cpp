#include <fcntl.h>
#include <gmock/gmock.h>
#include <grp.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <sys/xattr.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <thread>

#include "tests/io/exr_files.h"
#include "tests/io/synced_files.h"
#include "tests/io/written_files.h"
#include "tests/support/status.h"
#include "tools/sequence/files/atomic_file.h"

namespace postchain::io {
namespace {

using test::must;
using test::read_text;
using test::SyncedFiles;
using test::TempFolder;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

using AtomicWrite = InOut;

std::string error_of(const std::string& path) {
    const Result<AtomicFile> file = AtomicFile::create(path);
    EXPECT_FALSE(file.ok());
    EXPECT_EQ(file.status().code(), StatusCode::output);
    EXPECT_THAT(file.status().message(), HasSubstr(path));
    return file.status().message();
}

// Runs `body` in a child process; returns its exit status.
template <class Body>
int in_child(Body body) {
    const pid_t child = ::fork();
    if (child == 0) ::_exit(body());
    int status = 0;
    ::waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : 1000 + WTERMSIG(status);
}

void write(AtomicFile& file, const std::string& text) {
    EXPECT_EQ(test::error_of(file.write(text.data(), text.size())), "");
}

TEST_F(AtomicWrite, TheNameAppearsOnlyOnCommit) {
    const std::string large(3'000'000, 'x');  // more than the buffer
    {
        auto file = must(AtomicFile::create(folder.path("a")));
        write(file, "0000");
        write(file, large);
        EXPECT_TRUE(file.seek(1).ok());
        write(file, "12");
        EXPECT_EQ(file.position(), 3u);
        EXPECT_EQ(file.size(), 3'000'004u);
        EXPECT_THAT(folder.names(), ElementsAre(".a." + std::to_string(::getpid()) + ".tmp"));
        EXPECT_TRUE(must(file.commit(OnExisting::fail)));
        EXPECT_EQ(read_text(folder.path("a")), "0120" + large);
        auto given_up = must(AtomicFile::create(folder.path("b")));
        write(given_up, "hello");
    }
    EXPECT_THAT(folder.names(), ElementsAre("a"));
}

struct stat info_of(const std::string& path) {
    struct stat info = {};
    EXPECT_EQ(::stat(path.c_str(), &info), 0) << path;
    return info;
}

TEST_F(AtomicWrite, AReplacedFileKeepsModeOwnerAndAttributes) {
    const std::string path = folder.path("a.txt");
    test::write_text(path, "old");
    const bool is_root = ::geteuid() == 0;
    if (is_root) {
        ASSERT_EQ(::chown(path.c_str(), 12345, 23456), 0);
    }
    ASSERT_EQ(::chmod(path.c_str(), 04640), 0);  // the bit of another user's rights is not kept
    const bool has_attributes = ::setxattr(path.c_str(), "user.shot", "0x10", 4, 0) == 0 &&
                                ::setxattr(path.c_str(), "user.a", "", 0, 0) == 0;
    ASSERT_TRUE(atomic_write_text(path, "new", OnExisting::overwrite).ok());
    EXPECT_EQ(read_text(path), "new");
    EXPECT_EQ(info_of(path).st_mode & 07777, 0640u);
    if (is_root) {
        EXPECT_EQ(info_of(path).st_uid, 12345u);
        EXPECT_EQ(info_of(path).st_gid, 23456u);
    }
    char value[8] = {};
    EXPECT_EQ(::getxattr(path.c_str(), "user.shot", value, 8), has_attributes ? 4 : -1);
    EXPECT_EQ(std::string(value), has_attributes ? "0x10" : "");
    EXPECT_EQ(::getxattr(path.c_str(), "user.a", value, 8), has_attributes ? 0 : -1);
    // A new file is as the system makes it.
    ASSERT_TRUE(atomic_write_text(folder.path("b.txt"), "new", OnExisting::overwrite).ok());
    EXPECT_EQ(info_of(folder.path("b.txt")).st_uid, ::geteuid());
    // A link is replaced, not the file it leads to, whose mode is its own.
    std::filesystem::create_symlink("a.txt", folder.path("link"));
    ASSERT_EQ(::chmod(path.c_str(), 0600), 0);
    ASSERT_TRUE(atomic_write_text(folder.path("link"), "other", OnExisting::overwrite).ok());
    EXPECT_EQ(read_text(path), "new");
    EXPECT_EQ(info_of(folder.path("link")).st_mode, info_of(folder.path("b.txt")).st_mode);
}

TEST_F(AtomicWrite, AReplacedFileOfAnotherUserKeepsItsGroup) {
    if (::geteuid() != 0) GTEST_SKIP() << "skipped: only root can be another user";
    const std::string path = folder.path("a.txt");
    test::write_text(path, "old");
    ASSERT_EQ(::chown(path.c_str(), 12345, 23456), 0);
    ASSERT_EQ(::chmod(path.c_str(), 0660), 0);
    ASSERT_EQ(::chmod(folder.path().c_str(), 0773), 0);  // which that user cannot read, nor sync
    const int result = in_child([&] {
        const gid_t group = 23456;
        if (::setgroups(1, &group) != 0 || ::setgid(34567) != 0 || ::setuid(34567) != 0) return 1;
        return atomic_write_text(path, "new", OnExisting::overwrite).ok() ? 0 : 2;
    });
    ASSERT_EQ(result, 0);
    EXPECT_EQ(info_of(path).st_uid, 34567u);
    EXPECT_EQ(info_of(path).st_gid, 23456u);
    EXPECT_EQ(info_of(path).st_mode & 07777, 0660u);
}

// After a power failure the name holds the whole file: its bytes are on disk before it has the
// name, and then the folder is.
TEST_F(AtomicWrite, IsSyncedBeforeItIsRenamedAndItsFolderAfterwards) {
    const std::string path = folder.path("a.txt");
    SyncedFiles& synced = test::synced_files();
    synced = {};
    ASSERT_TRUE(atomic_write_text(path, "new", OnExisting::fail).ok());
    EXPECT_THAT(synced.paths, ElementsAre(HasSubstr(".tmp"), folder.path()));
    struct Case {
        int error, folder_error;
        const char* message;  // of a failure
        bool there;           // whether the name has the new file
    };
    for (const Case& one :
         {Case{EIO, 0, "cannot write", false}, Case{0, EIO, "its folder cannot be synced", true},
          Case{0, EINVAL, nullptr, true}, Case{0, EOPNOTSUPP, nullptr, true}}) {
        std::filesystem::remove(path);
        synced = {.error = one.error, .folder_error = one.folder_error};
        const Result<bool> done = atomic_write_text(path, "new", OnExisting::overwrite);
        EXPECT_EQ(done.ok(), one.message == nullptr);
        EXPECT_THAT(done.status().message(), HasSubstr(one.message ? one.message : ""));
        EXPECT_EQ(std::filesystem::exists(path), one.there) << done.status().message();
        EXPECT_EQ(folder.names().size(), one.there ? 1u : 0u);
    }
    synced = {};
}

TEST(ReplaceLock, ExcludesOthersUntilItsEnd) {
    const TempFolder folder;
    const std::string path = folder.path("a.exr");
    std::atomic<int> inside = 0, times = 0;
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
        threads.emplace_back([&] {
            for (int k = 0; k < 20; ++k) {
                const auto lock = must(ReplaceLock::take(path));
                EXPECT_EQ(++inside, 1);
                ::usleep(200);
                --inside;
                ++times;
            }
        });
    for (auto& thread : threads) thread.join();
    EXPECT_EQ(times, 80);
    EXPECT_THAT(folder.names(), IsEmpty());
    // One that a killed process has left is in no one's way, and counts as a temporary.
    test::write_text(folder.path(".a.exr.0.tmp"), "");
    EXPECT_TRUE(ReplaceLock::take(path).ok());
    EXPECT_THAT(folder.names(), IsEmpty());
    EXPECT_TRUE(is_temporary_of(".a.exr.0.tmp", "a.exr"));
}

TEST(Claim, IsHeldByOneUntilItsEnd) {
    const TempFolder folder;
    const std::string path = folder.path("claim");
    {
        auto first = must(Claim::take(path));
        ASSERT_TRUE(first);
        EXPECT_FALSE(must(Claim::take(path)));
    }
    auto second = must(Claim::take(path));
    ASSERT_TRUE(second);
    EXPECT_THAT(folder.names(), ElementsAre("claim"));
    second->finish();
    EXPECT_THAT(folder.names(), IsEmpty());
    EXPECT_EQ(Claim::take(folder.path("none/claim")).status().code(), StatusCode::output);
    std::filesystem::create_symlink("elsewhere", path);
    EXPECT_EQ(Claim::take(path).status().code(), StatusCode::output);
    EXPECT_THAT(folder.names(), ElementsAre("claim")) << "a link leads nowhere";
}

TEST(ReplaceLock, PutsBackWhatDescribesAFileThatIsNotReplaced) {
    const TempFolder folder;
    const std::string image = folder.path("a.exr"), sidecar = folder.path("a.exr.json");
    test::write_text(image, "old");
    test::write_text(sidecar, "of old");
    {
        auto lock = ReplaceLock::take(image);
        EXPECT_TRUE(lock->set_aside(sidecar).ok());
        EXPECT_FALSE(std::filesystem::exists(sidecar));
    }
    EXPECT_EQ(read_text(sidecar), "of old");
    {
        auto lock = ReplaceLock::take(image);
        EXPECT_TRUE(lock->set_aside(sidecar).ok());
        EXPECT_TRUE(atomic_write_text(image, "new", OnExisting::overwrite).ok());
    }
    EXPECT_THAT(folder.names(), ElementsAre("a.exr"));
    // Files that have the names afterwards are another process's.
    for (const char* name : {".a.exr.0.tmp", ".a.exr.json.0.tmp"})
        test::write_text(folder.path(name), "");
    remove_live_temporaries();
    EXPECT_EQ(folder.names().size(), 3u);
    // Nothing of it stays if a signal ends the process.
    test::write_text(sidecar, "of new");
    auto lock = ReplaceLock::take(image);
    EXPECT_TRUE(lock->set_aside(sidecar).ok());
    remove_live_temporaries();
    EXPECT_THAT(folder.names(), ElementsAre("a.exr"));
}

TEST_F(AtomicWrite, ExistingFileUnderEachPolicy) {
    const std::string path = folder.path("a.txt");
    test::write_text(path, "old");
    const Status refused = atomic_write_text(path, "new", OnExisting::fail).status();
    EXPECT_EQ(refused.code(), StatusCode::output);
    EXPECT_THAT(refused.message(), HasSubstr("exists already"));
    EXPECT_EQ(read_text(path), "old");
    EXPECT_FALSE(must(atomic_write_text(path, "new", OnExisting::skip)));
    EXPECT_EQ(read_text(path), "old");
    EXPECT_TRUE(must(atomic_write_text(path, "new", OnExisting::overwrite)));
    EXPECT_EQ(read_text(path), "new");
    EXPECT_THAT(folder.names(), ElementsAre("a.txt"));
}

TEST_F(AtomicWrite, SaysWhatIsWrongWithThePath) {
    test::write_text(folder.path("file"), "x");
    for (const auto& [name, why] : {std::pair(std::string("none/a.exr"), "does not exist"),
                                    {"none/deeper/a.exr", "does not exist"},
                                    {"file/a.exr", "file is a file, not a folder"},
                                    {"file/b/a.exr", "file is a file, not a folder"},
                                    {".", "is a folder"},
                                    {"", "no file name"},
                                    {std::string(250, 'n'), "name is too long"},
                                    {std::string(256, 'n') + "/a.exr", "name is too long"},
                                    {std::string(5000, 'n'), "name is too long"}})
        EXPECT_THAT(error_of(folder.path(name)), HasSubstr(why));
    EXPECT_FALSE(error_of("/proc/a.exr").empty());  // not even root can write there
    EXPECT_THAT(folder.names(), ElementsAre("file"));
}

TEST_F(AtomicWrite, ReplacesATemporaryOfADeadProcessButNoneThatIsBeingWritten) {
    const std::string path = folder.path("a.txt"),
                      left = folder.path(".a.txt." + std::to_string(::getpid()) + ".tmp");
    test::write_text(left, "left behind, longer than what follows");
    const int fd = ::open(left.c_str(), O_WRONLY);
    ASSERT_EQ(::flock(fd, LOCK_EX), 0);  // as by a process with our number in another container
    EXPECT_THAT(error_of(path), HasSubstr("another process"));
    EXPECT_EQ(read_text(left), "left behind, longer than what follows");
    ::close(fd);
    EXPECT_TRUE(must(atomic_write_text(path, "new", OnExisting::fail)));
    EXPECT_EQ(read_text(path), "new");
    EXPECT_THAT(folder.names(), ElementsAre("a.txt"));
    auto first = must(AtomicFile::create(folder.path("b.txt")));
    EXPECT_THAT(error_of(folder.path("b.txt")), HasSubstr("already being written by this process"));
    // A link in place of a temporary leads nowhere.
    test::write_text(folder.path("c"), "of another");
    for (const std::string& link : {left, folder.path(".a.txt.0.tmp")})
        std::filesystem::create_symlink("c", link);
    EXPECT_THAT(error_of(path), HasSubstr("another process"));
    EXPECT_THAT(ReplaceLock::take(path).status().message(), HasSubstr("cannot lock it"));
    EXPECT_EQ(read_text(folder.path("c")), "of another");
}

// Another process takes what is not locked yet for what a killed one has left.
TEST_F(AtomicWrite, WhatIsRemovedBeforeItIsLockedIsCreatedAgain) {
    SyncedFiles& files = test::synced_files();
    const std::string path = folder.path("a.txt");
    int removals = 0;
    files.before_lock = [&](const std::string& created) {
        if (removals-- > 0) {
            EXPECT_EQ(::unlink(created.c_str()), 0);
        }
    };
    for (const int times : {1, 3}) {
        removals = times;
        EXPECT_TRUE(must(atomic_write_text(path, concat(times), OnExisting::overwrite)));
        EXPECT_EQ(read_text(path), concat(times));
        removals = times;
        const auto lock = must(ReplaceLock::take(path));
        EXPECT_THAT(folder.names(), ElementsAre(".a.txt.0.tmp", "a.txt")) << "nobody else has it";
    }
    removals = 1000;
    EXPECT_THAT(error_of(path), HasSubstr("another process"));
    // The other one holds it while it removes it.
    int held = -1;
    files.before_lock = [&](const std::string& created) {
        if (held >= 0) return;
        held = ::open(created.c_str(), O_WRONLY);
        EXPECT_EQ(::flock(held, LOCK_EX) + ::unlink(created.c_str()), 0);
    };
    EXPECT_TRUE(must(atomic_write_text(path, "after", OnExisting::overwrite)));
    ::close(held);
    files.before_lock = {};
    EXPECT_THAT(folder.names(), ElementsAre("a.txt"));
}

TEST_F(AtomicWrite, AFileSystemWithoutLocksIsWrittenTo) {
    const std::string path = folder.path("a.txt");
    for (const int error : {ENOLCK, ENOSYS, EOPNOTSUPP, EIO}) {
        test::synced_files() = {.lock_error = error};
        const bool none = error != EIO;
        EXPECT_EQ(atomic_write_text(path, "new", OnExisting::overwrite).ok(), none);
        EXPECT_TRUE(ReplaceLock::take(path).ok());
        EXPECT_EQ(folder.names().size(), 1u) << "nothing is left behind";
    }
    EXPECT_THAT(error_of(path), HasSubstr("cannot lock it: Input/output error"));
    EXPECT_THAT(Claim::take(folder.path("claim")).status().message(),
                HasSubstr("cannot be locked: Input/output error"));
    test::synced_files() = {};
}

// Some cannot rename without replacing.
TEST_F(AtomicWrite, AFileSystemWithoutSuchARenameLosesNothing) {
    const std::string path = folder.path("a.txt"), beside = folder.path("a.txt.json");
    for (const int error : {EINVAL, ENOSYS, EIO}) {
        SCOPED_TRACE(error);
        std::filesystem::remove(path);
        test::synced_files() = {.rename_error = error};
        const bool can = error != EIO;
        EXPECT_EQ(atomic_write_text(path, "first", OnExisting::fail).ok(), can);
        EXPECT_EQ(folder.names().size(), can ? 1u : 0u);
        test::write_text(path, "old");
        EXPECT_FALSE(atomic_write_text(path, "new", OnExisting::fail).ok());
        EXPECT_EQ(atomic_write_text(path, "new", OnExisting::skip).ok(), can);
        EXPECT_EQ(read_text(path), "old");
        EXPECT_THAT(folder.names(), ElementsAre("a.txt"));
    }
    test::synced_files() = {.rename_error = EINVAL};
    test::write_text(beside, "of old");
    EXPECT_TRUE(must(ReplaceLock::take(path)).set_aside(beside).ok());
    EXPECT_EQ(read_text(beside), "of old");
    EXPECT_THAT(folder.names(), ElementsAre("a.txt", "a.txt.json"));
    test::synced_files() = {};
}

TEST_F(AtomicWrite, WhatKilledProcessesLeftIsRemovedAndNothingElse) {
    for (const char* name : {".a.txt.123.tmp", ".a.txt.4567890.tmp", ".b.txt.123.tmp",  // a's, b's
                             ".a.txt.tmp", ".a.txt.12x.tmp", "a.txt.123.tmp", ".a.txt.123.bak"})
        test::write_text(folder.path(name), "x");
    const int held = ::open(folder.path(".a.txt.4567890.tmp").c_str(), O_WRONLY);
    ASSERT_EQ(::flock(held, LOCK_EX), 0);
    remove_dead_temporaries(folder.path(), [](const auto& name) { return name == "a.txt"; });
    EXPECT_THAT(folder.names(),
                ElementsAre(".a.txt.123.bak", ".a.txt.12x.tmp", ".a.txt.4567890.tmp", ".a.txt.tmp",
                            ".b.txt.123.tmp", "a.txt.123.tmp"));
    ::close(held);
    remove_dead_temporaries(folder.path(), [](const auto& name) { return name == "a.txt"; });
    EXPECT_EQ(folder.names().size(), 5u);
    EXPECT_TRUE(is_temporary_of(".a.txt.123.tmp", "a.txt"));
    EXPECT_FALSE(is_temporary_of(".a.txt.123.tmp", "txt"));
    EXPECT_FALSE(is_temporary_of("..123.tmp", ""));
    EXPECT_FALSE(is_temporary_of(".123.tmp", "123.tmp"));
    EXPECT_FALSE(is_temporary_of(".a..tmp", "a"));
    EXPECT_FALSE(is_temporary_of(".a.12-.tmp", "a"));
}

TEST_F(AtomicWrite, ASignalsShutdownRemovesEveryLiveTemporary) {
    auto a = must(AtomicFile::create(folder.path("a"))),
         b = must(AtomicFile::create(folder.path("b")));
    EXPECT_TRUE(must(a.commit(OnExisting::fail)));
    auto c = must(AtomicFile::create(folder.path("c")));
    test::write_text(a.temporary(), "of a process with our number in another container");
    remove_live_temporaries();
    const std::string theirs = ".a." + std::to_string(::getpid()) + ".tmp";
    EXPECT_THAT(folder.names(), ElementsAre(theirs, "a"));
    std::filesystem::remove(folder.path(theirs));
    EXPECT_FALSE(b.commit(OnExisting::overwrite).ok());
    EXPECT_FALSE(c.commit(OnExisting::fail).ok());
    EXPECT_THAT(folder.names(), ElementsAre("a"));
}

TEST_F(AtomicWrite, AFileSizeLimitIsAClearErrorAndLeavesNothing) {
    for (const int limit : {1, 1000, 1'500'000}) {
        const int result = in_child([&] {
            ::signal(SIGXFSZ, SIG_IGN);
            const rlimit lower{rlim_t(limit), rlim_t(limit)};
            ::setrlimit(RLIMIT_FSIZE, &lower);
            const Result<bool> done = atomic_write_text(
                folder.path("a.txt"), std::string(2'000'000, 'x'), OnExisting::fail);
            if (done.ok()) return 1;
            if (done.status().code() != StatusCode::output) return 2;
            return done.status().message().find("file-size limit") == std::string::npos ? 3 : 0;
        });
        EXPECT_EQ(result, 0) << limit;
        EXPECT_THAT(folder.names(), IsEmpty());
    }
}

TEST_F(AtomicWrite, AFullDiskIsAClearError) {
    auto file = must(AtomicFile::create(folder.path("a")));
    // Redirects the temporary's descriptor to /dev/full.
    int descriptor = -1;
    for (const auto& entry : std::filesystem::directory_iterator("/proc/self/fd")) {
        std::error_code ignored;
        if (std::filesystem::read_symlink(entry, ignored).string() == file.temporary())
            descriptor = std::stoi(entry.path().filename().string());
    }
    ASSERT_GE(descriptor, 0);
    const int full = ::open("/dev/full", O_WRONLY);
    ASSERT_GE(full, 0);
    ASSERT_EQ(::dup2(full, descriptor), descriptor);
    const std::string large(2'000'000, 'x');
    const Status written = file.write(large.data(), large.size());
    ::close(full);
    EXPECT_EQ(written.code(), StatusCode::output);
    EXPECT_THAT(written.message(), HasSubstr("disk full"));
    EXPECT_FALSE(file.commit(OnExisting::overwrite).ok()) << "the failure must stick";
}

}  // namespace
}  // namespace postchain::io
