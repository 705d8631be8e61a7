// Status and Result: how every part of postchain reports failure.
//
// The library throws nothing across its border and never aborts its host: a function that can
// fail returns a Status, or a Result<T> that holds either a value or a Status. Tools turn the
// code into an exit code (tools/sequence/record/frame_report.h).
#pragma once

#include <cassert>
#include <locale>
#include <sstream>
#include <string>
#include <utility>
#include <variant>

#include "chain/base/setting_text.h"

namespace postchain {

enum class StatusCode {
    ok,
    usage,     // an argument of the caller is wrong
    chain,     // the chain or its parameters are invalid
    input,     // an input is missing, unreadable, or lacks a plane a pass needs
    memory,    // an input takes more memory than is available or allowed
    output,    // an output cannot be written
    gl,        // no usable GL, out of GL memory, or a GL error
    health,    // non-finite values although the caller forbids them
    canceled,  // stopped by the caller
    internal,  // a defect of postchain itself
};

const char* name_of(StatusCode code);

// Success, or a code with a one-line message that names place and remedy, its settings as in
// setting_text.h.
class [[nodiscard]] Status {
  public:
    Status() = default;
    Status(StatusCode code, std::string message) : code_(code), message_(std::move(message)) {}

    bool ok() const { return code_ == StatusCode::ok; }
    StatusCode code() const { return code_; }
    const std::string& message() const { return message_; }

    // The same failure with "place: " put before its message; success stays success.
    Status at(const std::string& place) const;

  private:
    StatusCode code_ = StatusCode::ok;
    std::string message_;
};

Status input_error(std::string message);
Status input_error(const std::string& path, const std::string& what);  // "path: what"
// "place: not enough memory", or a shorter message if not even this one fits into memory.
Status out_of_memory(const std::string& place) noexcept;
// The exception now being handled: out_of_memory(), otherwise StatusCode::internal with its
// message. Call in a catch block only.
Status status_of_exception(const std::string& place) noexcept;

// A value, or the Status that explains its absence.
template <class T>
class [[nodiscard]] Result {
  public:
    Result(T value) : state_(std::move(value)) {}
    Result(Status status) : state_(std::move(status)) { assert(!std::get<Status>(state_).ok()); }

    bool ok() const { return std::holds_alternative<T>(state_); }
    T& value() { return std::get<T>(state_); }
    const T& value() const { return std::get<T>(state_); }
    T& operator*() { return value(); }
    const T& operator*() const { return value(); }
    T* operator->() { return &value(); }
    const T* operator->() const { return &value(); }
    Status status() const { return ok() ? Status() : std::get<Status>(state_); }

    // The same value, or the same failure with "place: " put before its message.
    Result at(const std::string& place) && {
        return ok() ? std::move(*this) : Result(std::get<Status>(state_).at(place));
    }

  private:
    std::variant<T, Status> state_;
};

// Returns from the function if the expression, a Status or another type with ok(), is a failure.
#define RETURN_IF_ERROR(...)                                             \
    do {                                                                 \
        if (auto status_ = (__VA_ARGS__); !status_.ok()) return status_; \
    } while (false)

// Assigns the value of the expression, a Result, to a declaration (`auto image`) or a variable;
// returns its Status from the function if there is no value.
#define ASSIGN_OR_RETURN(declaration, ...) \
    POSTCHAIN_ASSIGN_OR_RETURN(POSTCHAIN_JOIN(result_, __LINE__), declaration, __VA_ARGS__)
#define POSTCHAIN_ASSIGN_OR_RETURN(result, declaration, ...) \
    auto result = (__VA_ARGS__);                             \
    if (!result.ok()) return result.status();                \
    declaration = std::move(*result)
#define POSTCHAIN_JOIN(a, b) POSTCHAIN_JOIN_EXPANDED(a, b)
#define POSTCHAIN_JOIN_EXPANDED(a, b) a##b

// Text of all arguments put one after the other, numbers at the stream's default precision.
template <class... Args>
std::string concat(const Args&... args) {
    std::ostringstream out;
    // Otherwise a stream hides a lack of memory, and the text ends early.
    out.exceptions(std::ios::badbit);
    out.imbue(std::locale::classic());
    (out << ... << args);
    return out.str();
}

}  // namespace postchain
