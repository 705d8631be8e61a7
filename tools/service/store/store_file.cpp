#include "tools/service/store/store_file.h"

#include <SQLiteCpp/Backup.h>
#include <fcntl.h>
#include <sqlite3.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <filesystem>
#include <thread>

#include "tools/sequence/files/atomic_file.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds kLockPatience(1);
constexpr int kBusyMs = 10'000;
constexpr int64_t kApplication = 0x70634a53;  // "pcJS", the application_id of a store
constexpr int64_t kVersion = 5;               // since release 0.2

// Bodies have a table of their own: SQLite would read and write up to 1 MiB with each row. ledger:
// bytes in the outputs of removed jobs. Of release 0.2: epochs, facts, and attempts of a job.
constexpr const char* kTables = R"sql(
CREATE TABLE jobs(
  id INTEGER PRIMARY KEY AUTOINCREMENT, kind TEXT NOT NULL, state TEXT NOT NULL,
  priority INTEGER NOT NULL, key TEXT NOT NULL, message TEXT NOT NULL DEFAULT '',
  created_ms INTEGER NOT NULL, started_ms INTEGER NOT NULL DEFAULT 0,
  ended_ms INTEGER NOT NULL DEFAULT 0, frames INTEGER NOT NULL DEFAULT 0,
  done INTEGER NOT NULL DEFAULT 0, failed INTEGER NOT NULL DEFAULT 0,
  exit_code INTEGER NOT NULL DEFAULT 0, verdict TEXT NOT NULL DEFAULT '',
  begun INTEGER NOT NULL DEFAULT 0, attempts INTEGER NOT NULL DEFAULT 0,
  owner TEXT NOT NULL DEFAULT '', bytes INTEGER NOT NULL DEFAULT 0,
  remote TEXT NOT NULL DEFAULT '', output TEXT NOT NULL DEFAULT '',
  about TEXT NOT NULL DEFAULT '{}', names TEXT NOT NULL DEFAULT '',
  writes TEXT NOT NULL DEFAULT '', ended_event INTEGER NOT NULL DEFAULT 0);
CREATE UNIQUE INDEX jobs_key ON jobs(key) WHERE key <> '';
CREATE INDEX jobs_queue ON jobs(state, priority DESC, id);
CREATE TABLE frames(
  job INTEGER NOT NULL REFERENCES jobs(id) ON DELETE CASCADE, place INTEGER NOT NULL,
  frame INTEGER NOT NULL, state TEXT NOT NULL, attempts INTEGER NOT NULL DEFAULT 0,
  begun INTEGER NOT NULL DEFAULT 0, in_flight INTEGER NOT NULL DEFAULT 0,
  alone INTEGER NOT NULL DEFAULT 0, held INTEGER NOT NULL DEFAULT 0, output TEXT NOT NULL, message TEXT NOT NULL DEFAULT '',
  filter_ms REAL NOT NULL DEFAULT 0,
  PRIMARY KEY(job, frame)) WITHOUT ROWID;
CREATE TABLE events(
  id INTEGER PRIMARY KEY AUTOINCREMENT, job INTEGER NOT NULL REFERENCES jobs(id) ON DELETE CASCADE,
  time_ms INTEGER NOT NULL, type TEXT NOT NULL, data TEXT NOT NULL);
CREATE INDEX events_job ON events(job, id);
CREATE TABLE turns(owner TEXT PRIMARY KEY, turn INTEGER NOT NULL);
CREATE TABLE requests(
  job INTEGER PRIMARY KEY REFERENCES jobs(id) ON DELETE CASCADE, body TEXT NOT NULL);
CREATE TABLE ledger(
  owner TEXT NOT NULL, writes TEXT NOT NULL, bytes INTEGER NOT NULL,
  PRIMARY KEY(owner, writes)) WITHOUT ROWID;
CREATE TABLE epochs(first INTEGER PRIMARY KEY, after INTEGER NOT NULL);
CREATE TABLE facts(name TEXT PRIMARY KEY, value INTEGER NOT NULL) WITHOUT ROWID;
)sql";

// Converts the exception that is being handled.
Status status_of(const std::string& path) {
    try {
        throw;
    } catch (const SqlError& error) {
        const auto failure = [&](const std::string& text) {
            return Status(StatusCode::output, path + ": " + text);
        };
        switch (error.getErrorCode() & 0xff) {
            case SQLITE_BUSY:
            case SQLITE_LOCKED:
                return failure("another program holds this store; end that program");
            case SQLITE_NOTADB:
                return failure("is not a store of jobs; choose another file for the store");
            case SQLITE_CORRUPT:
                return failure("the store is damaged (" + std::string(error.what()) +
                               "); move the file away, and the service creates a new one");
            case SQLITE_FULL:
                return failure("the disk is full; nothing was changed; free some space");
            default:
                return failure("the store cannot be used: " + std::string(error.what()));
        }
    } catch (const Status& refused) {
        return refused;
    } catch (...) {
        return status_of_exception(path);
    }
}

// Zeros if there is no file.
std::pair<dev_t, ino_t> identity_of(const std::string& path) {
    struct stat info = {};
    if (::stat(path.c_str(), &info) != 0) return {};
    return {info.st_dev, info.st_ino};
}

// Of the file that links lead to.
std::string real_path(const std::string& path) {
    std::error_code error;
    const auto real = fs::weakly_canonical(path, error);
    return error ? path : real.string();
}

// Through a lock of SQLite on any of its files a reader could stop every change. Errors (output).
Status close_to_others(const std::string& path) {
    for (const char* suffix : {"", "-wal", "-shm"})
        if (::chmod((real_path(path) + suffix).c_str(), 0600) != 0 && errno != ENOENT)
            return Status(StatusCode::output, concat(path, suffix, ": ", std::strerror(errno),
                                                     "; it must belong to this user"));
    return Status();
}

// SQLite's log has the name of the store, so that a second one would be another log. Errors
// (output).
Status check_one_name(const std::string& path) {
    struct stat found = {};
    if (::stat(path.c_str(), &found) != 0) return Status();
    if (!S_ISREG(found.st_mode)) return Status(StatusCode::output, path + ": is not a file");
    if (found.st_nlink < 2) return Status();
    return Status(StatusCode::output, path +
                                          ": has a second name (hard link), by which another "
                                          "service could use it; remove that name");
}

bool is_store(const std::string& path) try {
    Database found(path, Database::Open::existing);
    return found.number("PRAGMA application_id") == kApplication;
} catch (const SqlError& error) {
    if ((error.getErrorCode() & 0xff) == SQLITE_NOTADB) return false;
    throw;
}

// Creates the tables of a new store. Throws SqlError, or Status if it is not one of this program.
void prepare(Database& database, const std::string& path) {
    const bool empty = database.number("SELECT COUNT(*) FROM sqlite_master") == 0;
    const int64_t version = database.number("PRAGMA user_version");
    const auto refused = [&](const std::string& text) {
        return Status(StatusCode::output, concat(path, ": ", text, "; choose another file"));
    };
    if (!empty && database.number("PRAGMA application_id") != kApplication)
        throw refused("is a database of another program");
    if (!empty && version != kVersion)
        throw refused(concat("is a store of ", version > kVersion ? "a later" : "an earlier",
                             " version (", version, ", this program reads ", kVersion, ")"));
    if (!empty)
        if (const std::string found = database.text("PRAGMA quick_check(1)"); found != "ok")
            throw SqlError(found, SQLITE_CORRUPT);
    database.run("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON");
    if (!empty) return;
    SQLite::Transaction transaction(database);
    database.run(kTables);
    database.run(
        concat("PRAGMA application_id = ", kApplication, "; PRAGMA user_version = ", kVersion));
    transaction.commit();
}

int flags_of(Database::Open how) {
    return (how == Database::Open::reading ? SQLite::OPEN_READONLY : SQLite::OPEN_READWRITE) |
           (how == Database::Open::created ? SQLite::OPEN_CREATE : 0) | SQLite::OPEN_FULLMUTEX;
}

// Empty, and closed to other users: SQLite gives its log the mode of the file.
const std::string& made(const std::string& path, Database::Open how) {
    if (how == Database::Open::created)
        if (const int file = ::open(path.c_str(), O_CREAT | O_EXCL | O_CLOEXEC, 0600); file >= 0)
            ::close(file);
    return path;
}

}  // namespace

// A backup or a look with another program holds the file for a moment.
Database::Database(const std::string& path, Open how)
    : SQLite::Database(made(path, how), flags_of(how), kBusyMs) {}

StoreLock::~StoreLock() {
    if (file_ >= 0) ::close(file_);
}

Status StoreLock::take(const std::string& store) {
    const std::string path = real_path(store) + ".lock";
    file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
    if (file_ < 0)
        return Status(StatusCode::output, concat(path, ": ", std::strerror(errno),
                                                 "; choose another folder for the store"));
    struct stat found = {};
    if (::fstat(file_, &found) != 0 || !S_ISREG(found.st_mode) || found.st_uid != ::geteuid() ||
        ::fchmod(file_, 0600) != 0)
        return Status(StatusCode::output, path + ": must be a file of this user; remove it");
    // A service that was killed has its lock until it has ended.
    const auto end = std::chrono::steady_clock::now() + kLockPatience;
    while (::flock(file_, LOCK_EX | LOCK_NB) != 0) {
        if (std::chrono::steady_clock::now() > end)
            return Status(
                StatusCode::output,
                store + ": another service uses this store; stop it, or choose another file");
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return Status();
}

Status StoreFile::take() {
    RETURN_IF_ERROR(io::check_folder_of(path_));
    RETURN_IF_ERROR(check_one_name(path_));
    RETURN_IF_ERROR(lock_.take(path_));
    try {
        database_.emplace(path_);
        prepare(*database_, path_);
        RETURN_IF_ERROR(close_to_others(path_));
        for (Reader& reader : readers_) reader.database.emplace(path_, Database::Open::reading);
        file_ = identity_of(path_);
        return Status();
    } catch (...) {
        return status_of(path_);
    }
}

Status StoreFile::commit(const std::function<void(Database&)>& work) {
    std::vector<Event> events;
    RETURN_IF_ERROR(in_place());
    try {
        const std::lock_guard lock(mutex_);
        said_.clear();
        SQLite::Transaction transaction(*database_, SQLite::TransactionBehavior::IMMEDIATE);
        work(*database_);
        transaction.commit();
        events.swap(said_);
    } catch (...) {
        return status_of(path_);
    }
    const std::lock_guard lock(listener_mutex_);
    if (listener_)
        for (const Event& event : events) listener_(event);
    return Status();
}

Status StoreFile::read(const std::function<void(Database&)>& work, Reading who) const {
    Reader& reader = readers_[size_t(who)];
    try {
        const std::lock_guard lock(reader.mutex);
        work(*reader.database);
        return Status();
    } catch (...) {
        return status_of(path_);
    }
}

void StoreFile::add_event(int64_t job, const std::string& type, const io::Json& data) {
    Event event{0, std::to_string(job), now_ms(), type, io::json_text(data)};
    database_->run("INSERT INTO events(job, time_ms, type, data) VALUES(?, ?, ?, ?)", job,
                   event.time_ms, type, event.data);
    event.id = database_->getLastInsertRowid();
    said_.push_back(std::move(event));
}

Status StoreFile::in_place() const {
    const bool lost = identity_of(path_) != file_;
    const Status status = lost ? Status(StatusCode::output,
                                        path_ +
                                            ": the store was removed or replaced while the service "
                                            "runs; nothing is recorded; put the file back, or "
                                            "restart the service")
                               : Status();
    const std::lock_guard lock(loss_mutex_);
    if (lost && !lost_ && loss_listener_) loss_listener_(status.message());
    lost_ = lost;
    return status;
}

void StoreFile::on_loss(std::function<void(const std::string&)> listener) {
    const std::lock_guard lock(loss_mutex_);
    loss_listener_ = std::move(listener);
}

void StoreFile::on_event(std::function<void(const Event&)> listener) {
    const std::lock_guard lock(listener_mutex_);
    listener_ = std::move(listener);
}

Status back_up(const std::string& store, const std::string& file) try {
    std::error_code error;
    if (!fs::exists(store, error))
        return Status(StatusCode::output, store + ": no store of jobs is here; see --store");
    if (!is_store(store))
        return Status(StatusCode::output, store + ": is not a store of jobs; name another file");
    if (fs::exists(file, error) && (fs::equivalent(store, file, error) || !is_store(file)))
        return Status(StatusCode::usage,
                      "--backup: " + file + " is not a backup of a store; choose another name");
    RETURN_IF_ERROR(io::check_folder_of(file));
    const std::string part = file + ".tmp";
    fs::remove(part, error);
    {
        Database from(store, Database::Open::existing), to(part);
        if (SQLite::Backup(to, from).executeStep() != SQLITE_DONE)
            throw SqlError("another program holds it", SQLITE_BUSY);
        // One file, which any tool can copy; the service changes it back.
        to.run("PRAGMA journal_mode = DELETE");
        if (const std::string fault = to.text("PRAGMA quick_check(1)"); fault != "ok")
            throw SqlError(fault, SQLITE_CORRUPT);
    }
    fs::rename(part, file, error);
    if (error) return Status(StatusCode::output, file + ": " + error.message());
    return Status();
} catch (const SqlError& failed) {
    std::error_code ignored;
    fs::remove(file + ".tmp", ignored);
    return Status(StatusCode::output,
                  concat("backup of ", store, " to ", file, ": ", failed.what()));
}

}  // namespace postchain::service
