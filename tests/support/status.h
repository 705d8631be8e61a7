// Short forms for Status and Result.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

#include "chain/base/status.h"

namespace postchain::test {

// The message of a failure; "" if there was none. EXPECT_EQ(error_of(result), "") shows it.
inline std::string error_of(const Status& status) {
    return status.message();
}
template <class T>
std::string error_of(const Result<T>& result) {
    return result.status().message();
}

// The value of a result that must have one: a failure throws its message, which ends the test.
template <class T>
T must(Result<T> result) {
    if (!result.ok()) throw std::runtime_error(error_of(result));
    return std::move(*result);
}

}  // namespace postchain::test
