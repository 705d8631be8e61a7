#include "tools/service/store/store_file.h"

#include <fcntl.h>
#include <sqlite3.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <thread>

#include "tools/sequence/files/atomic_file.h"
#include "tools/service/store/upkeep.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;

constexpr std::chrono::seconds kLockPatience(1);

// Converts the exception that is being handled.
Status status_of(const std::string& path) {
    try {
        throw;
    } catch (const SqlError& error) {
        const auto failure = [&](const std::string& text) {
            return Status(StatusCode::output, path + ": " + text);
        };
        switch (error.code & 0xff) {
            case SQLITE_BUSY:
            case SQLITE_LOCKED:
                return failure("another program holds this store; end that program");
            case SQLITE_NOTADB:
                return failure("is not a store of jobs; choose another file for the store");
            case SQLITE_CORRUPT:
                return failure("the store is damaged (" + error.message +
                               "); move the file away, and the service creates a new one");
            case SQLITE_FULL:
                return failure("the disk is full; nothing was changed; free some space");
            default:
                return failure("the store cannot be used: " + error.message);
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
    if (::stat(path.c_str(), &found) != 0 || found.st_nlink < 2) return Status();
    return Status(StatusCode::output, path +
                                          ": has a second name (hard link), by which another "
                                          "service could use it; remove that name");
}

bool is_store(const std::string& path) try {
    Database found(path, Database::Open::existing);
    return found.number("PRAGMA application_id") == kApplication;
} catch (const SqlError& error) {
    if ((error.code & 0xff) == SQLITE_NOTADB) return false;
    throw;
}

}  // namespace

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

int64_t StoreLock::newest() const {
    std::array<char, 32> text = {};
    const ssize_t size = ::pread(file_, text.data(), text.size() - 1, 0);
    int64_t id = 0;
    if (size > 0) std::from_chars(text.data(), text.data() + size, id);
    return id;
}

void StoreLock::set_newest(int64_t id) const {
    // One write, so that a process that dies leaves the former number or this one. Of one length.
    std::array<char, 32> text = {};
    const int size =
        std::snprintf(text.data(), text.size(), "%019lld\n", static_cast<long long>(id));
    // A lost number only makes one restored copy less noticed.
    if (::pwrite(file_, text.data(), size_t(size), 0) < 0) return;
}

Status StoreFile::take() {
    RETURN_IF_ERROR(io::check_folder_of(path_));
    RETURN_IF_ERROR(lock_.take(path_));
    RETURN_IF_ERROR(check_one_name(path_));
    try {
        database_.emplace(path_);
        prepare(*database_, path_, [&](int64_t version) {
            const std::string copy = concat(path_, ".v", version);
            if (Status copied = back_up(path_, copy); !copied.ok()) throw copied;
            note_ = concat(path_, " is converted; a copy for the former program is ", copy);
        });
        RETURN_IF_ERROR(close_to_others(path_));
        Transaction transaction(*database_);
        const int64_t former = newest_event_id(*database_);
        begin_epoch(*database_, lock_.newest());
        const int64_t newest = newest_event_id(*database_);
        transaction.commit();
        if (newest != former)
            note_ +=
                concat(note_.empty() ? "" : "; ", path_,
                       " is not the store that was here last; its events go on at ", newest + 1);
        lock_.set_newest(newest);
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
        Transaction transaction(*database_);
        work(*database_);
        transaction.commit();
        events.swap(said_);
        if (!events.empty()) lock_.set_newest(events.back().id);
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
    event.id = database_->last_id();
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

int64_t StoreFile::bytes() const {
    int64_t bytes = 0;
    for (const char* suffix : {"", "-wal"}) {
        struct stat info = {};
        if (::stat((path_ + suffix).c_str(), &info) == 0) bytes += info.st_size;
    }
    return bytes;
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
        sqlite3_backup* copy = sqlite3_backup_init(to.handle(), "main", from.handle(), "main");
        if (!copy) throw SqlError{sqlite3_errcode(to.handle()), sqlite3_errmsg(to.handle())};
        const int code = sqlite3_backup_step(copy, -1);
        sqlite3_backup_finish(copy);
        if (code != SQLITE_DONE) throw SqlError{code, sqlite3_errstr(code)};
        mark_copy(to);
        // One file, which any tool can copy; the service changes it back.
        to.run("PRAGMA journal_mode = DELETE");
        if (const std::string fault = to.text("PRAGMA quick_check(1)"); fault != "ok")
            throw SqlError{SQLITE_CORRUPT, fault};
    }
    fs::rename(part, file, error);
    if (error) return Status(StatusCode::output, file + ": " + error.message());
    return Status();
} catch (const SqlError& failed) {
    std::error_code ignored;
    fs::remove(file + ".tmp", ignored);
    return Status(StatusCode::output,
                  concat("backup of ", store, " to ", file, ": ", failed.message));
}

}  // namespace postchain::service
