// The file of the store: other programs, versions and processes, backups, damage, full disks.
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tests/service/store_fixture.h"
#include "tools/service/store/store_file.h"

namespace {

int g_syncs = 0;

}  // namespace

// Counts SQLite's calls: symbols of the program come before those of the C library.
extern "C" int fdatasync(int fd) {
    ++g_syncs;
    return int(syscall(SYS_fdatasync, fd));
}
extern "C" int fsync(int fd) {
    ++g_syncs;
    return int(syscall(SYS_fsync, fd));
}

namespace postchain::service {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

TEST_F(StoreTest, TwoServicesRefuseEachOther) {
    open();
    EXPECT_THAT(refusal(), HasSubstr("another service uses this store"));
    fs::create_symlink(path(), folder_.path("link.db"));
    EXPECT_FALSE(JobStore::open(folder_.path("link.db"), 3).ok()) << "by another name";
    store_.reset();
    EXPECT_EQ(refusal(), "opened");
}

TEST_F(StoreTest, OtherFilesAreRefusedAndStay) {
    const std::string text(5000, 'x');
    std::ofstream(path()) << text;
    EXPECT_THAT(refusal(), HasSubstr("is not a store of jobs"));
    EXPECT_EQ(test::read_text(path()), text);
    fs::remove(path());
    run_sql("CREATE TABLE jobs(a)");
    EXPECT_THAT(refusal(), HasSubstr("of another program"));
    fs::remove(path());
    open();
    store_.reset();
    run_sql("PRAGMA user_version = 99");
    EXPECT_THAT(refusal(), HasSubstr("later version"));
    run_sql("PRAGMA user_version = 2");
    EXPECT_THAT(refusal(), HasSubstr("was created before the first release"));
    EXPECT_EQ(JobStore::open(folder_.path("nowhere/store.db"), 3).status().code(),
              StatusCode::output);
}

// While the store is in use, by this program and by SQLite's own; the copy is whole and usable.
TEST_F(StoreTest, BackupsOfAStoreInUse) {
    open();
    const std::string id = running(2);
    const std::string copy = folder_.path("backup.sqlite"), shell = folder_.path("shell.sqlite");
    ASSERT_TRUE(back_up(path(), copy).ok());
    begin(id, 1);
    EXPECT_TRUE(back_up(path(), copy).ok()) << "again";
    const std::string command = concat("sqlite3 ", path(), " '.backup ", shell, "'");
    EXPECT_EQ(std::system(command.c_str()), 0);
    write(id, 1);
    for (const std::string& file : {copy, shell}) {
        const auto restored = test::must(JobStore::open(file, 3));
        EXPECT_EQ((**restored->job(id)).state, JobState::queued);
        EXPECT_EQ(restored->to_do(id)->size(), 2u);
    }
    std::ofstream(folder_.path("mine")) << "mine";
    EXPECT_EQ(back_up(path(), folder_.path("mine")).code(), StatusCode::usage);
    EXPECT_EQ(test::read_text(folder_.path("mine")), "mine");
    EXPECT_EQ(back_up(path(), path()).code(), StatusCode::usage);
    EXPECT_EQ(back_up(folder_.path("none"), copy).code(), StatusCode::output);
}

TEST_F(StoreTest, ADamagedStoreIsSaidToBe) {
    open();
    for (int i = 0; i < 50; ++i)
        ASSERT_TRUE(store_->add({JobKind::run, std::string(3000, 'b'), 0, ""}, 1000).ok());
    store_.reset();
    {
        std::fstream file(path(), std::ios::in | std::ios::out | std::ios::binary);
        file.seekp(8192);
        file << std::string(60000, '\xff');
    }
    EXPECT_THAT(refusal(), HasSubstr("damaged"));
}

// On a full disk calls fail and change nothing; the store works again when there is room.
TEST_F(StoreTest, ADiskThatIsFull) {
    open();
    const std::string id = running(2);
    begin(id, 1);
    std::signal(SIGXFSZ, SIG_IGN);
    struct rlimit before;
    ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
    struct rlimit full = before;
    full.rlim_cur = rlim_t(fs::file_size(path() + "-wal") + 100'000);
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &full), 0);
    const std::string large(20'000, 'b');
    size_t taken = 0;
    Status refused;
    while (refused.ok() && taken < 100) {
        refused = store_->add({JobKind::run, large, 0, ""}, 1000).status();
        taken += refused.ok();
    }
    const Status end = store_->frame_ends(id, {1, FrameState::written, large, false, 0, 1});
    const JobFrame meanwhile = frame(id, 1);
    ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
    EXPECT_EQ(refused.code(), StatusCode::output) << refused.message();
    EXPECT_EQ(end.code(), StatusCode::output) << end.message();
    EXPECT_EQ(meanwhile.state, FrameState::waiting);
    EXPECT_EQ(store_->jobs("queued", "", 1000)->size(), taken);
    write(id, 1);
    open();
    EXPECT_EQ(job(id).done, 1);
    EXPECT_EQ(job_count(), taken + 1);
}

// SQLite writes on into a file without a name: a job would be accepted and lost.
TEST_F(StoreTest, AFileThatIsTakenAwayRefusesChanges) {
    open();
    add();
    std::vector<std::string> said;
    store_->on_loss([&](const std::string& text) { said.push_back(text); });
    for (const bool replaced : {false, true}) {
        said.clear();
        fs::rename(path(), folder_.path("away.db"));
        if (replaced) std::ofstream(path()) << "another";
        const auto refused = store_->add({JobKind::run, "{}", 0, ""}, 100);
        EXPECT_EQ(refused.status().code(), StatusCode::output);
        EXPECT_THAT(refused.status().message(),
                    HasSubstr("store.db: the store was removed or replaced"));
        EXPECT_FALSE(store_->in_place().ok());
        EXPECT_EQ(said, std::vector<std::string>({refused.status().message()}));
        fs::rename(folder_.path("away.db"), path());  // put back
        EXPECT_TRUE(store_->in_place().ok());
        add();
    }
    open();
    EXPECT_EQ(job_count(), 3u);
}

// What a reply has confirmed is on the disk: power may fail after it.
TEST_F(StoreTest, EachChangeIsOnTheDiskWhenItReturns) {
    open();
    for (int i = 0; i < 3; ++i) {
        const int before = g_syncs;
        const std::string id = add();
        EXPECT_GT(g_syncs, before) << "a new job";
        const int added = g_syncs;
        ASSERT_TRUE(*store_->cancel(id));
        EXPECT_GT(g_syncs, added) << "its end";
    }
}

}  // namespace
}  // namespace postchain::service
