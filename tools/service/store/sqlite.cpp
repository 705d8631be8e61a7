#include "tools/service/store/sqlite.h"

#include <fcntl.h>
#include <sqlite3.h>
#include <unistd.h>

#include <new>

namespace postchain::service {
namespace {

constexpr int kBusyMs = 10'000;

[[noreturn]] void fail(sqlite3* handle, int code) {
    if (code == SQLITE_NOMEM) throw std::bad_alloc();
    throw SqlError{code, handle ? sqlite3_errmsg(handle) : sqlite3_errstr(code)};
}

void check(sqlite3* handle, int code) {
    if (code != SQLITE_OK) fail(handle, code);
}

}  // namespace

Database::Database(const std::string& path, Open how) {
    // Closed to other users. SQLite gives its log the same mode.
    if (how == Open::created)
        if (const int made = ::open(path.c_str(), O_CREAT | O_EXCL | O_CLOEXEC, 0600); made >= 0)
            ::close(made);
    const int flags = (how == Open::reading ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE) |
                      (how == Open::created ? SQLITE_OPEN_CREATE : 0) | SQLITE_OPEN_FULLMUTEX |
                      SQLITE_OPEN_EXRESCODE;
    const int code = sqlite3_open_v2(path.c_str(), &handle_, flags, nullptr);
    // A backup or a look with another program holds the file for a moment.
    if (code == SQLITE_OK) sqlite3_busy_timeout(handle_, kBusyMs);
    if (code == SQLITE_OK) return;
    const SqlError error{code, handle_ ? sqlite3_errmsg(handle_) : sqlite3_errstr(code)};
    sqlite3_close_v2(handle_);
    throw error;
}

Database::~Database() {
    sqlite3_close_v2(handle_);
}

void Database::run(const std::string& sql) {
    check(handle_, sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr));
}

int64_t Database::last_id() const {
    return sqlite3_last_insert_rowid(handle_);
}

int Database::changes() const {
    return sqlite3_changes(handle_);
}

void Statement::prepare(const std::string& sql) {
    check(database_.handle(),
          sqlite3_prepare_v2(database_.handle(), sql.c_str(), -1, &statement_, nullptr));
}

Statement::~Statement() {
    sqlite3_finalize(statement_);
}

void Statement::bind(int64_t value) {
    check(database_.handle(), sqlite3_bind_int64(statement_, ++bound_, value));
}

void Statement::bind(double value) {
    check(database_.handle(), sqlite3_bind_double(statement_, ++bound_, value));
}

void Statement::bind(std::string_view value) {
    check(database_.handle(), sqlite3_bind_text64(statement_, ++bound_, value.data(), value.size(),
                                                  SQLITE_TRANSIENT, SQLITE_UTF8));
}

bool Statement::step() {
    const int code = sqlite3_step(statement_);
    if (code == SQLITE_ROW) return true;
    if (code != SQLITE_DONE) fail(database_.handle(), code);
    return false;
}

int64_t Statement::integer(int column) const {
    return sqlite3_column_int64(statement_, column);
}

double Statement::number(int column) const {
    return sqlite3_column_double(statement_, column);
}

std::string Statement::text(int column) const {
    const auto* text = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
    return text ? std::string(text, size_t(sqlite3_column_bytes(statement_, column)))
                : std::string();
}

Transaction::Transaction(Database& database) : database_(database) {
    database_.run("BEGIN IMMEDIATE");
}

Transaction::~Transaction() {
    // After some errors SQLite has undone it already; then this one does nothing.
    if (open_) sqlite3_exec(database_.handle(), "ROLLBACK", nullptr, nullptr, nullptr);
}

void Transaction::commit() {
    database_.run("COMMIT");
    open_ = false;
}

}  // namespace postchain::service
