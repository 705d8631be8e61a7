// Shared by the targets: guarantees that abort when broken, and a folder for files.
#pragma once

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "chain/base/status.h"
#include "tools/sequence/exr/exr_reader.h"

namespace postchain::fuzz {

// Every seed is far below these limits; a hostile header is not.
constexpr io::ReadLimits kLimits = {.max_side = 2048,
                                    .max_bytes = uint64_t(4) << 20,
                                    .max_chunk_bytes = uint64_t(8) << 20,
                                    .max_channels = 256};

// Unlike assert(), checks in every build.
inline void require(bool holds, const char* guarantee) {
    if (holds) return;
    std::fprintf(stderr, "broken guarantee: %s\n", guarantee);
    std::abort();
}

// A refusal, and only a refusal, has a reason.
inline void require_reason(const Status& status) {
    require(status.ok() == status.message().empty(), "errors have a message, successes none");
}

// A unique folder for files, in memory if possible. Created again each time, because libFuzzer ends
// the process without destroying static objects.
class OutputFolder {
  public:
    OutputFolder() {
        std::error_code failed;
        const std::filesystem::path memory = "/dev/shm";
        const bool there = std::filesystem::is_directory(memory, failed);
        name_ = (there ? memory : std::filesystem::temp_directory_path()) / "postchain_fuzz_XXXXXX";
        require(::mkdtemp(name_.data()) != nullptr, "a folder can be made");
    }
    ~OutputFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(name_, ignored);
    }
    OutputFolder(const OutputFolder&) = delete;
    std::string path(const std::string& file) const { return name_ + "/" + file; }

  private:
    std::string name_;
};

}  // namespace postchain::fuzz
