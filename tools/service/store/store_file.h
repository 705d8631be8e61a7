// The file of a store. Each change and its events are one transaction, which is on disk
// (synchronous=FULL) before the call returns: a successful change is never lost, and a failed one
// changes nothing. One process at a time uses the file. If the file is removed or replaced, every
// change is refused: it would be in no file. Thread-safe.
#pragma once

#include <sys/types.h>
#include <array>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "chain/base/status.h"
#include "tools/sequence/files/json.h"
#include "tools/service/store/job.h"
#include "tools/service/store/sqlite.h"

namespace postchain::service {

// One service at a time uses a store. SQLite's own exclusive lock would also stop backups.
class StoreLock {
  public:
    StoreLock() = default;
    ~StoreLock();
    StoreLock(const StoreLock&) = delete;
    StoreLock& operator=(const StoreLock&) = delete;

    // Locks STORE.lock, beside the file that links lead to, until this object or the process ends.
    // It is closed to other users: whoever can read a file can lock it. Errors (output): another
    // service has it, it is not of this user, or cannot be created.
    Status take(const std::string& store);

  private:
    int file_ = -1;
};

class StoreFile {
  public:
    // Errors (output): the file was removed or replaced after it was opened.
    Status in_place() const;
    // Called by a change or in_place() when the file is no longer in place, once until it is again.
    void on_loss(std::function<void(const std::string&)> listener);
    // Called after each commit, with the store unlocked.
    void on_event(std::function<void(const Event&)> listener);

  protected:
    explicit StoreFile(std::string path) : path_(std::move(path)) {}
    ~StoreFile() = default;
    StoreFile(const StoreFile&) = delete;
    StoreFile& operator=(const StoreFile&) = delete;

    // Locks the file, creates its tables if it is new, and closes it to other users. Errors
    // (output): it cannot be created or written, is in use, is damaged, is from another program or
    // version, or has a second name.
    Status take();
    // Runs `work` with the database in a transaction. Returns its result, or a Status if it has
    // none.
    template <class Work>
    auto change(const Work& work) {
        using T = std::invoke_result_t<Work, Database&>;
        if constexpr (std::is_void_v<T>) {
            return commit(work);
        } else {
            T value{};
            Status status = commit([&](Database& database) { value = work(database); });
            return status.ok() ? Result<T>(std::move(value)) : Result<T>(std::move(status));
        }
    }
    // Runs one statement in a transaction.
    template <class... Values>
    Status set(const char* sql, const Values&... values) {
        return commit([&](Database& database) { database.run(sql, values...); });
    }
    // Who reads without a transaction. Each has a connection of its own, which waits neither for
    // changes nor for the other: streams of events read without a pause when they are far behind.
    enum class Reading { requests, streams };
    template <class Work>
    auto look(const Work& work, Reading who = Reading::requests) const {
        using T = std::invoke_result_t<Work, Database&>;
        T value{};
        Status status = read([&](Database& database) { value = work(database); }, who);
        return status.ok() ? Result<T>(std::move(value)) : Result<T>(std::move(status));
    }
    // The rows of a query, and its first one.
    template <class Convert, class... Values>
    auto rows(const Convert& convert, const std::string& sql, const Values&... values) const {
        return look(
            [&](Database& database) { return all(Statement(database, sql, values...), convert); });
    }
    template <class Convert, class... Values>
    auto row(const Convert& convert, const std::string& sql, const Values&... values) const {
        return look([&](Database& database) {
            return first(Statement(database, sql, values...), convert);
        });
    }
    // Within a change.
    void add_event(int64_t job, const std::string& type, const io::Json& data = io::Json::object());

  private:
    Status commit(const std::function<void(Database&)>& work);
    Status read(const std::function<void(Database&)>& work, Reading who) const;

    struct Reader {
        std::mutex mutex;
        std::optional<Database> database;
    };
    const std::string path_;
    StoreLock lock_;
    std::mutex mutex_;
    std::optional<Database> database_;
    mutable std::array<Reader, 2> readers_;  // closed before the other, which closes the log
    std::pair<dev_t, ino_t> file_ = {};      // identity of the opened file
    mutable std::mutex loss_mutex_;
    mutable bool lost_ = false;
    std::function<void(const std::string&)> loss_listener_;
    std::vector<Event> said_;  // events of the open transaction
    std::mutex listener_mutex_;
    std::function<void(const Event&)> listener_;
};

// Copies the store to `file` in one consistent state, with the copying of SQLite, which does not
// disturb the service. Replaces an earlier backup. Errors (usage): `file` is another file than a
// backup; (output): the store cannot be read, or the copy not written.
Status back_up(const std::string& store, const std::string& file);

}  // namespace postchain::service
