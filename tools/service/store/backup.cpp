#include "tools/service/store/backup.h"

#include <sqlite3.h>

#include <filesystem>

#include "tools/service/store/sqlite.h"
#include "tools/service/store/upkeep.h"

namespace postchain::service {
namespace {

namespace fs = std::filesystem;

bool is_store(const std::string& path) try {
    Database found(path, Database::Open::existing);
    return found.number("PRAGMA application_id") == kApplication;
} catch (const SqlError& error) {
    if ((error.code & 0xff) == SQLITE_NOTADB) return false;
    throw;
}

}  // namespace

Status back_up(const std::string& store, const std::string& file) try {
    std::error_code error;
    if (!fs::exists(store, error))
        return Status(StatusCode::output, store + ": no store of jobs is here; see --store");
    if (!is_store(store)) return Status(StatusCode::output, store + ": is not a store of jobs");
    if (fs::exists(file, error) && (fs::equivalent(store, file, error) || !is_store(file)))
        return Status(StatusCode::usage,
                      "--backup: " + file + " is not a backup of a store; choose another name");
    const std::string part = file + ".tmp";
    fs::remove(part, error);
    {
        Database from(store, Database::Open::existing), to(part);
        sqlite3_backup* copy = sqlite3_backup_init(to.handle(), "main", from.handle(), "main");
        if (!copy) throw SqlError{sqlite3_errcode(to.handle()), sqlite3_errmsg(to.handle())};
        const int code = sqlite3_backup_step(copy, -1);
        sqlite3_backup_finish(copy);
        if (code != SQLITE_DONE) throw SqlError{code, sqlite3_errstr(code)};
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
