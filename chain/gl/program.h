// Compute programs by ProgramKey, compiled once. Sources are embedded; with POSTCHAIN_SHADER_DIR
// set they are read from that folder instead (development).
#pragma once

#include <functional>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "chain/plan.h"
#include "chain/status.h"

namespace postchain::gl {

// The text of `file` (a path under shaders/) with every `#include "path"` replaced by that file
// and #line directives kept. Errors name file and line: missing file, include circle.
Result<std::string> resolve_includes(const std::string& file, std::vector<std::string>* files);

class ProgramCache {
  public:
    explicit ProgramCache(std::function<void(const std::string&)> log = {})
        : log_(std::move(log)) {}
    ~ProgramCache();
    // The program, compiled on first use. StatusCode::gl with the compiler's log, its file numbers
    // replaced by names. In development mode a changed file is compiled again; when that fails the
    // last good program stays and `log` is told once.
    Result<unsigned> get(const ProgramKey& key);
    size_t compiled() const { return compiled_; }

  private:
    struct Entry {
        unsigned program = 0;
        uint64_t source_hash = 0;
    };
    std::function<void(const std::string&)> log_;
    std::map<std::string, Entry> entries_;
    size_t compiled_ = 0;
};

}  // namespace postchain::gl
