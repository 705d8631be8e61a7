// The sources of programs, and compiled programs that outlive the process.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "chain/plan/plan.h"

namespace postchain {

// The text of `file` (a path under shaders/) with every `#include "path"` replaced by that file and
// #line directives kept. `folder`: where they are read from; empty: the embedded files. Errors name
// file and line: missing file, include circle.
Result<std::string> resolve_includes(const std::string& file, const std::string& folder,
                                     std::vector<std::string>* files = nullptr);

// The text of a program as the compiler gets it.
Result<std::string> program_source(const ProgramKey& key, const std::string& folder = {});

// Likewise, of a source whose includes are resolved.
std::string with_defines(const std::string& source, const ProgramKey& key);

// The key of the program with this source among those made before (postchain-programs).
uint64_t program_key(const std::string& source);

// Compiled programs that outlive the process. Keys are hexadecimal. Either function may be empty.
struct ProgramStore {
    // The bytes of a key; empty: there are none.
    std::function<std::vector<std::byte>(const std::string& key)> load;
    std::function<void(const std::string& key, std::span<const std::byte> bytes)> store;
};

}  // namespace postchain
