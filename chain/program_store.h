// Compiled programs that outlive the process.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace postchain {

// Keys are hexadecimal. Either function may be empty.
struct ProgramStore {
    // The bytes of a key; empty: there are none.
    std::function<std::vector<std::byte>(const std::string& key)> load;
    std::function<void(const std::string& key, std::span<const std::byte> bytes)> store;
};

}  // namespace postchain
