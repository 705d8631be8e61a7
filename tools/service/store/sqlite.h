// SQLite for the store: statements and transactions that throw. Exceptions stay in this folder:
// job_store.cpp converts them to Status.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "chain/status.h"

struct sqlite3;
struct sqlite3_stmt;

namespace postchain::service {

struct SqlError {
    int code = 0;         // SQLITE_FULL, SQLITE_BUSY, ...
    std::string message;  // from SQLite
};

class Database {
  public:
    enum class Open { created, existing };  // created: if it does not exist
    // Throws SqlError.
    explicit Database(const std::string& path, Open how = Open::created);
    ~Database();
    Database(const Database&) = delete;
    Database& operator=(const Database&) = delete;

    void run(const char* sql);  // statements without parameters
    int64_t number(const char* sql);
    std::string text(const char* sql);
    int64_t last_id() const;
    int changes() const;  // rows changed by the last statement
    sqlite3* handle() const { return handle_; }

  private:
    sqlite3* handle_ = nullptr;
};

// One statement: bind from left to right, then step. Strings may contain any byte.
class Statement {
  public:
    Statement(Database& database, const char* sql);
    ~Statement();
    Statement(const Statement&) = delete;
    Statement& operator=(const Statement&) = delete;

    Statement& bind(int64_t value);
    Statement& bind(int value) { return bind(int64_t(value)); }
    Statement& bind(double value);
    Statement& bind(std::string_view value);
    bool step();  // false after the last row
    void run();   // to the end

    int64_t integer(int column) const;
    double number(int column) const;
    std::string text(int column) const;

  private:
    Database& database_;
    sqlite3_stmt* statement_ = nullptr;
    int bound_ = 0;
};

// Rolled back unless commit() is called.
class Transaction {
  public:
    explicit Transaction(Database& database);
    ~Transaction();
    Transaction(const Transaction&) = delete;
    Transaction& operator=(const Transaction&) = delete;
    void commit();

  private:
    Database& database_;
    bool open_ = true;
};

}  // namespace postchain::service
