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
#include "tools/service/http/job_json.h"
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
         {std::pair{99, "later version"}, {2, "before the first release"}}) {
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

// Its ids go on above all that it has given, and those in between are known to be lost.
TEST_F(StoreTest, EventsAfterACopyWasPutBack) {
    for (const bool by_backup : {true, false}) {
        open();
        const std::string id = add();
        const int64_t kept = events(id).back().id;
        const std::string copy = folder_.path("copy.sqlite");
        if (by_backup) {
            ASSERT_TRUE(back_up(path(), copy).ok());
        } else {
            store_.reset();
            fs::copy_file(path(), copy, fs::copy_options::overwrite_existing);
            open();
        }
        ASSERT_TRUE(*store_->cancel(id));
        const int64_t lost = events(id).back().id;
        EXPECT_GT(lost, kept);
        EXPECT_FALSE(*store_->is_lost(lost));
        EXPECT_TRUE(*store_->is_lost(lost + 1)) << "not given yet";
        for (int again = 0; again < 2; ++again) {
            store_.reset();
            fs::copy_file(copy, path(), fs::copy_options::overwrite_existing);
            open();
            EXPECT_TRUE(*store_->is_lost(lost)) << by_backup;
            EXPECT_FALSE(*store_->is_lost(kept));
            EXPECT_FALSE(*store_->is_lost(0));
            const std::string later = add();
            const int64_t next = events(later).back().id;
            EXPECT_GT(next, lost) << by_backup;
            EXPECT_TRUE(*store_->is_lost(next - 1)) << "no event has it";
            EXPECT_EQ(events(id).size(), 1u) << "its event is not old";
            open();
            EXPECT_FALSE(*store_->is_lost(next)) << "a restart is no loss";
        }
        store_.reset();
        for (const char* suffix : {"", ".lock"}) fs::remove(path() + suffix);
    }
}

TEST_F(StoreTest, EventsAfterACopyWithoutAnyWasPutBack) {
    const std::string copy = folder_.path("copy.sqlite");
    ASSERT_TRUE(back_up(path(), copy).ok());
    const int64_t lost = events(add()).back().id;
    store_.reset();
    fs::copy_file(copy, path(), fs::copy_options::overwrite_existing);
    open();
    EXPECT_GT(events(add()).back().id, lost + 1);
    EXPECT_TRUE(*store_->is_lost(lost));
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

// As the former version wrote it.
constexpr const char* kVersion4 = R"sql(
CREATE TABLE jobs(
  id INTEGER PRIMARY KEY AUTOINCREMENT, kind TEXT NOT NULL, state TEXT NOT NULL,
  priority INTEGER NOT NULL, body TEXT NOT NULL, key TEXT NOT NULL, message TEXT NOT NULL DEFAULT '',
  created_ms INTEGER NOT NULL, started_ms INTEGER NOT NULL DEFAULT 0,
  ended_ms INTEGER NOT NULL DEFAULT 0, frames INTEGER NOT NULL DEFAULT 0,
  done INTEGER NOT NULL DEFAULT 0, failed INTEGER NOT NULL DEFAULT 0,
  exit_code INTEGER NOT NULL DEFAULT 0, verdict TEXT NOT NULL DEFAULT '',
  begun INTEGER NOT NULL DEFAULT 0, attempts INTEGER NOT NULL DEFAULT 0,
  owner TEXT NOT NULL DEFAULT '', bytes INTEGER NOT NULL DEFAULT 0,
  remote TEXT NOT NULL DEFAULT '', output TEXT NOT NULL DEFAULT '',
  about TEXT NOT NULL DEFAULT '{}');
CREATE UNIQUE INDEX jobs_key ON jobs(key) WHERE key <> '';
CREATE INDEX jobs_queue ON jobs(state, priority DESC, id);
CREATE TABLE frames(
  job INTEGER NOT NULL REFERENCES jobs(id) ON DELETE CASCADE, place INTEGER NOT NULL,
  frame INTEGER NOT NULL, state TEXT NOT NULL, attempts INTEGER NOT NULL DEFAULT 0,
  begun INTEGER NOT NULL DEFAULT 0, in_flight INTEGER NOT NULL DEFAULT 0,
  alone INTEGER NOT NULL DEFAULT 0, held INTEGER NOT NULL DEFAULT 0, output TEXT NOT NULL,
  message TEXT NOT NULL DEFAULT '', filter_ms REAL NOT NULL DEFAULT 0,
  PRIMARY KEY(job, frame)) WITHOUT ROWID;
CREATE TABLE events(
  id INTEGER PRIMARY KEY AUTOINCREMENT, job INTEGER NOT NULL REFERENCES jobs(id) ON DELETE CASCADE,
  time_ms INTEGER NOT NULL, type TEXT NOT NULL, data TEXT NOT NULL);
CREATE INDEX events_job ON events(job, id);
CREATE TABLE turns(owner TEXT PRIMARY KEY, turn INTEGER NOT NULL);
PRAGMA application_id = 1885555283;
PRAGMA user_version = 4;
INSERT INTO jobs(kind, state, priority, body, key, message, created_ms, started_ms, ended_ms, frames,
                 done, failed, exit_code, verdict, owner, bytes, output, about)
  VALUES('ab', 'failed', 3, '{"output": "Out/b.exr"}', 'k', 'why', 1005, 2007, 3011, 4, 2, 1, 8, 'v',
         'ann', 70, 'to', '{"chain": "c"}');
INSERT INTO jobs(kind, state, priority, body, key, created_ms, remote)
  VALUES('run', 'running', 0, 'no JSON', '', 5, '17');
INSERT INTO frames(job, place, frame, state, attempts, held, output, message, filter_ms)
  VALUES(1, 0, 9, 'quarantined', 2, 0, 'o9', 'a fault', 0), (1, 1, 7, 'written', 1, 1, 'o7', '', 2.5);
INSERT INTO events(job, time_ms, type, data)
  VALUES(1, 1005, 'queued', '{"kind":"ab"}'), (1, 3011, 'done', '{}');
)sql";

TEST_F(StoreTest, AStoreOfTheFormerVersionIsCopiedAndConverted) {
    replace(kVersion4);
    open();
    EXPECT_THAT(said_, testing::ElementsAre(HasSubstr("is converted; a copy")));
    EXPECT_EQ(
        io::json_text(json_of(**store_->job_of_key("k"), job_fields())),
        R"({"id":"1","kind":"ab","state":"failed","owner":"ann","priority":3,"message":"why",)"
        R"("created":"1970-01-01T00:00:01.005Z","started":"1970-01-01T00:00:02.007Z",)"
        R"("ended":"1970-01-01T00:00:03.011Z","frames":4,"done":2,"failed":1,"bytes":70,"place":0,)"
        R"("remaining_s":0.0,"exit_code":8,"verdict":"v","about":{"chain":"c"},)"
        R"("request":{"output":"Out/b.exr"}})");
    std::string frames;
    for (const JobFrame& frame : test::must(store_->frames("1")))
        frames += io::json_text(json_of(frame, frame_fields())) + "\n";
    EXPECT_EQ(frames,
              R"({"frame":9,"state":"quarantined","attempts":2,"output":"o9","message":"a fault",)"
              R"("filter_ms":0.0})"
              "\n"
              R"({"frame":7,"state":"written","attempts":1,"output":"o7","message":"",)"
              R"("filter_ms":2.5})"
              "\n");
    EXPECT_EQ(store_->tally("1")->held, 1);
    EXPECT_EQ(store_->jobs("", "", 9, "", "out/b")->size(), 1u);
    EXPECT_EQ(told("1"), (std::vector<std::string>{R"(queued {"kind":"ab"})", "done {}"}));
    EXPECT_EQ(std::tuple(events("1")[1].id, events("1")[1].time_ms), std::tuple(2, 3011));
    EXPECT_EQ(*store_->remote("2"), "17");
    EXPECT_EQ(job("2").state, JobState::queued);
    ASSERT_TRUE(*store_->forget("1"));
    EXPECT_TRUE(events("1").empty()) << "rows still belong to their jobs";
    open();
    EXPECT_EQ(job_count(), 1u);
    // The way back: the copy is a store of the former version.
    Database copy(path() + ".v4", Database::Open::existing);
    EXPECT_EQ(copy.number("PRAGMA user_version"), 4);
    EXPECT_EQ(copy.text("SELECT body FROM jobs WHERE id = 2"), "no JSON");
}

TEST_F(StoreTest, WithoutACopyNothingIsConverted) {
    replace(kVersion4);
    std::ofstream(path() + ".v4") << "a file of another program";
    EXPECT_THAT(refusal(), HasSubstr(".v4 is not a backup of a store"));
    Database former(path(), Database::Open::existing);
    EXPECT_EQ(former.number("PRAGMA user_version"), 4);
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
