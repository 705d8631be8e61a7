// A set of programs as SPIR-V in one block of bytes, written when a host is built
// (postchain-programs) and handed to pc_vk_create().
//
//   "PCSPIRV1"  version: 24 bytes  count: 8 bytes
//   count x { key, offset, bytes: 8 bytes each }, sorted by key
//   words of all programs
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "chain/base/status.h"

namespace postchain::vk {

class ProgramSet {
  public:
    ProgramSet() = default;  // empty
    // Refers to the bytes. StatusCode::usage: they are damaged, or of another version.
    static Result<ProgramSet> read(std::span<const std::byte> bytes);
    static std::vector<std::byte> write(const std::map<uint64_t, std::vector<uint32_t>>& programs);
    std::optional<std::vector<uint32_t>> find(uint64_t key) const;

  private:
    std::span<const std::byte> bytes_;
    size_t count_ = 0;
};

}  // namespace postchain::vk
