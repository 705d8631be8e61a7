// The file of the store: other programs, versions and processes, backups, damage, full disks.
#include <gmock/gmock.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <future>
#include <thread>

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
using testing::EndsWith;
using testing::HasSubstr;
using testing::StartsWith;

TEST_F(StoreTest, TwoServicesRefuseEachOther) {
    EXPECT_THAT(refusal(), HasSubstr("another service uses this store"));
    fs::create_symlink(path(), folder_.path("link.db"));
    EXPECT_THAT(JobStore::open(folder_.path("link.db"), 3).status().message(),
                HasSubstr("another service uses this store"));
    // One that was killed and is still ending is waited for.
    std::thread ending([&] {
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
        store_.reset();
    });
    EXPECT_EQ(refusal(), "opened");
    ending.join();
    EXPECT_EQ(refusal(), "opened");
}

TEST_F(StoreTest, ASecondNameIsRefused) {
    fs::create_directory(folder_.path("other"));
    fs::create_hard_link(path(), folder_.path("other/hard.db"));
    EXPECT_THAT(JobStore::open(folder_.path("other/hard.db"), 3).status().message(),
                HasSubstr("has a second name (hard link)"));
}

// Whoever can open a file can lock it.
TEST_F(StoreTest, OtherUsersCannotOpenItsFiles) {
    const auto closed = [&] {
        for (const char* suffix : {"", "-wal", "-shm", ".lock"})
            EXPECT_EQ(fs::status(path() + suffix).permissions() & fs::perms::all,
                      fs::perms::owner_read | fs::perms::owner_write)
                << suffix;
    };
    closed();
    // As a former version left it, after it was killed.
    Database other(path(), Database::Open::existing);
    other.number("SELECT COUNT(*) FROM jobs");
    store_.reset();
    for (const char* suffix : {"", "-wal", "-shm"})
        fs::permissions(path() + suffix, fs::perms::others_read, fs::perm_options::add);
    open();
    closed();
    store_.reset();
    fs::rename(path() + ".lock", folder_.path("mine"));
    fs::create_symlink(folder_.path("mine"), path() + ".lock");
    EXPECT_THAT(refusal(), HasSubstr(".lock: "));
}

TEST_F(StoreTest, OtherFilesAreRefusedAndStay) {
    store_.reset();
    const std::string text(5000, 'x');
    std::ofstream(path()) << text;
    EXPECT_THAT(refusal(), HasSubstr("is not a store of jobs"));
    EXPECT_EQ(test::read_text(path()), text);
    replace("CREATE TABLE jobs(a)");
    EXPECT_THAT(refusal(), HasSubstr("of another program"));
    fs::remove(path());
    open();
    for (const auto& [version, why] :
         {std::pair{99, "a later version"}, {4, "an earlier version"}}) {
        run_sql(concat("PRAGMA user_version = ", version));
        EXPECT_THAT(refusal(), HasSubstr(why));
    }
    const std::string nowhere = folder_.path("nowhere/store.db");
    for (const Status& missing : {JobStore::open(nowhere, 3).status(), back_up(path(), nowhere)}) {
        EXPECT_EQ(missing.code(), StatusCode::output);
        EXPECT_THAT(missing.message(), StartsWith(nowhere + ": folder "));
        EXPECT_THAT(missing.message(), EndsWith(" does not exist; create it first"));
    }
}

// While the store is in use, by this program and by SQLite's own; the copy is whole and usable.
TEST_F(StoreTest, BackupsOfAStoreInUse) {
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
    EXPECT_EQ(back_up(folder_.path("mine"), copy).code(), StatusCode::output);
    EXPECT_EQ(back_up(path(), folder_.path()).code(), StatusCode::output) << "a folder";
    replace("CREATE TABLE mine(a)");
    EXPECT_EQ(back_up(copy, path()).code(), StatusCode::usage) << "another program's";
    EXPECT_EQ(back_up(path(), copy).code(), StatusCode::output);
    EXPECT_EQ(Database(path(), Database::Open::existing).number("SELECT COUNT(*) FROM mine"), 0);
}

// While another program holds the file, and a change waits for it.
TEST_F(StoreTest, ReadsDoNotWaitForChanges) {
    const std::string id = add();
    sqlite3* other = nullptr;
    ASSERT_EQ(sqlite3_open(path().c_str(), &other), SQLITE_OK);
    ASSERT_EQ(sqlite3_exec(other, "BEGIN IMMEDIATE", nullptr, nullptr, nullptr), SQLITE_OK);
    std::thread change([&] { EXPECT_TRUE(*store_->cancel(id)); });
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    auto read = std::async(std::launch::async, [&] { return store_->jobs("", "", 10)->size(); });
    const bool in_time = read.wait_for(std::chrono::seconds(4)) == std::future_status::ready;
    sqlite3_exec(other, "COMMIT", nullptr, nullptr, nullptr);
    sqlite3_close(other);
    change.join();
    EXPECT_TRUE(in_time);
    EXPECT_EQ(read.get(), 1u);
}

// Streams that are far behind read all the time.
TEST_F(StoreTest, RequestsAndStreamsOfEventsDoNotWaitForEachOther) {
    struct OpenStore : StoreFile {
        explicit OpenStore(const std::string& path) : StoreFile(path) {}
        using StoreFile::look, StoreFile::Reading, StoreFile::take;
    };
    add();
    store_.reset();
    OpenStore store(path());
    ASSERT_TRUE(store.take().ok());
    const auto count = [](Database& database) {
        return database.number("SELECT COUNT(*) FROM jobs");
    };
    using Reading = OpenStore::Reading;
    for (const auto& [first, second] : {std::pair(Reading::requests, Reading::streams),
                                        std::pair(Reading::streams, Reading::requests)}) {
        std::future<int64_t> read;
        const auto meanwhile = [&](Database&) {
            read = std::async(std::launch::async, [&] { return *store.look(count, second); });
            return read.wait_for(std::chrono::seconds(4)) == std::future_status::ready;
        };
        EXPECT_TRUE(*store.look(meanwhile, first));
        EXPECT_EQ(read.get(), 1);
    }
}

// Lists, searches and changes read and write rows without the requests, which may have 1 MiB.
TEST_F(StoreTest, RequestsAreApartFromTheRowsOfJobs) {
    const std::string body =
        R"({"input": "Shots/A.####.exr", "chain_text": ")" + std::string(400'000, '#') + "\"}";
    const std::string id =
        test::must(store_->add({JobKind::run, body, 0, ""}, 100, user_of("ann"))).job.id;
    const auto size = fs::file_size(path() + "-wal");
    for (int priority = 1; priority <= 20; ++priority)
        ASSERT_TRUE(*store_->set_priority(id, priority));
    EXPECT_LT(fs::file_size(path() + "-wal") - size, 1'500'000u) << "bytes of 20 changes";
    EXPECT_EQ(job(id).body, body);
    EXPECT_EQ((**store_->listed(id)).body, "");
    for (const char* words : {"shots/a", "QUEUED ann", "run a.####"})
        EXPECT_EQ(store_->jobs("", "", 9, "", words)->size(), 1u) << words;
    EXPECT_TRUE(store_->jobs("", "", 9, "", "chain_text")->empty());
}

TEST_F(StoreTest, ADamagedStoreIsSaidToBe) {
    for (int i = 0; i < 50; ++i)
        ASSERT_TRUE(store_->add({JobKind::run, std::string(3000, 'b'), 0, ""}, 1000).ok());
    store_.reset();
    {
        std::fstream file(path(), std::ios::in | std::ios::out | std::ios::binary);
        file.seekp(8192);
        file << std::string(60000, '\xff');
    }
    EXPECT_THAT(refusal(), HasSubstr("damaged"));
    EXPECT_EQ(back_up(path(), folder_.path("copy")).code(), StatusCode::output);
    for (const char* name : {"copy", "copy.tmp"})
        EXPECT_FALSE(fs::exists(folder_.path(name))) << name;
}

// On a full disk calls fail and change nothing; the store works again when there is room.
TEST_F(StoreTest, ADiskThatIsFull) {
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
