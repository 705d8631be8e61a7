// SQLite for the store, by SQLiteCpp, which throws SqlError. Exceptions stay in this folder:
// store_file.h converts them to Status.
#pragma once

#include <SQLiteCpp/SQLiteCpp.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace postchain::service {

using SqlError = SQLite::Exception;

class Database : public SQLite::Database {
  public:
    // created: if it does not exist, closed to other users.
    enum class Open { created, existing, reading };
    explicit Database(const std::string& path, Open how = Open::created);

    // Returns the number of changed rows. Without values: any number of statements.
    template <class... Values>
    int run(const std::string& sql, const Values&... values);
    // The first column of the first row; 0 or empty if there is none.
    template <class... Values>
    int64_t number(const std::string& sql, const Values&... values);
    template <class... Values>
    std::string text(const std::string& sql, const Values&... values);
};

// One statement with the values of its parameters, from left to right. Strings may contain any
// byte.
class Statement : public SQLite::Statement {
  public:
    template <class... Values>
    Statement(Database& database, const std::string& sql, const Values&... values)
        : SQLite::Statement(database, sql) {
        int bound = 0;
        (bind(++bound, values), ...);
    }
    bool step() { return executeStep(); }  // false after the last row
    int64_t integer(int column) const { return getColumn(column).getInt64(); }
    double number(int column) const { return getColumn(column).getDouble(); }
    std::string text(int column) const { return getColumn(column).getString(); }
};

// The rows of a query, and its first one.
template <class Convert>
auto all(Statement rows, const Convert& convert) {
    std::vector<decltype(convert(rows))> found;
    while (rows.step()) found.push_back(convert(rows));
    return found;
}
template <class Convert>
auto first(Statement rows, const Convert& convert) {
    return rows.step() ? std::optional(convert(rows)) : std::nullopt;
}

template <class... Values>
int Database::run(const std::string& sql, const Values&... values) {
    if constexpr (sizeof...(values) == 0) return exec(sql);
    return Statement(*this, sql, values...).exec();
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

}  // namespace postchain::service
