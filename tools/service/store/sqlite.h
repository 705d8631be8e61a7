// SQLite for the store: statements and transactions that throw. Exceptions stay in this folder:
// store_file.h converts them to Status.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "chain/base/status.h"

struct sqlite3;
struct sqlite3_stmt;

namespace postchain::service {

struct SqlError {
    int code = 0;         // SQLITE_FULL, SQLITE_BUSY, ...
    std::string message;  // from SQLite
};

class Database {
  public:
    enum class Open { created, existing, reading };  // created: if it does not exist
    // Throws SqlError.
    explicit Database(const std::string& path, Open how = Open::created);
    ~Database();
    Database(const Database&) = delete;
    Database& operator=(const Database&) = delete;

    // Statements without parameters.
    void run(const std::string& sql);
    // One statement. Returns the number of changed rows.
    template <class... Values>
    int run(const std::string& sql, const Values&... values);
    // The first column of the first row; 0 or empty if there is none.
    template <class... Values>
    int64_t number(const std::string& sql, const Values&... values);
    template <class... Values>
    std::string text(const std::string& sql, const Values&... values);
    int64_t last_id() const;
    sqlite3* handle() const { return handle_; }

  private:
    int changes() const;
    sqlite3* handle_ = nullptr;
};

// One statement with the values of its parameters, from left to right. Strings may contain any
// byte.
class Statement {
  public:
    template <class... Values>
    Statement(Database& database, const std::string& sql, const Values&... values)
        : database_(database) {
        prepare(sql);
        (bind(values), ...);
    }
    ~Statement();
    Statement(const Statement&) = delete;
    Statement& operator=(const Statement&) = delete;

    bool step();  // false after the last row

    int64_t integer(int column) const;
    double number(int column) const;
    std::string text(int column) const;

  private:
    void prepare(const std::string& sql);
    void bind(int64_t value);
    void bind(int value) { bind(int64_t(value)); }
    void bind(double value);
    void bind(std::string_view value);
    void bind(const std::vector<std::string>& values) {
        for (const std::string& value : values) bind(value);
    }
    Database& database_;
    sqlite3_stmt* statement_ = nullptr;
    int bound_ = 0;
};

template <class... Values>
int Database::run(const std::string& sql, const Values&... values) {
    Statement statement(*this, sql, values...);
    while (statement.step()) {
    }
    return changes();
}

template <class... Values>
int64_t Database::number(const std::string& sql, const Values&... values) {
    Statement statement(*this, sql, values...);
    return statement.step() ? statement.integer(0) : 0;
}

template <class... Values>
std::string Database::text(const std::string& sql, const Values&... values) {
    Statement statement(*this, sql, values...);
    return statement.step() ? statement.text(0) : std::string();
}

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
