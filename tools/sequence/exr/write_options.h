// Options for writing a file of pixels, and the report about it. For EXR and other formats.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/exr/exr_settings.h"
#include "tools/sequence/files/atomic_file.h"

namespace postchain::io {

inline constexpr float kMaxHalf = 65504;

enum class HalfOverflow {
    refuse,  // an error with their number
    clamp,   // to the largest value of the channel's type, and count them
};

struct WriteOptions {
    OnExisting on_existing = OnExisting::fail;
    HalfOverflow overflow = HalfOverflow::refuse;
    int zip_level = kZipLevel;
    ExrSettings exr = {};  // for write_filtered()
    // Data window of the color part, grown outwards if its subsampled channels need that. Default:
    // the input's.
    std::optional<Window> window = {};
    // String attributes of the color part ("postchain" -> version and chain hash).
    std::map<std::string, std::string> attributes = {};
    // Called when everything is written, before the file gets its name; an error drops the file.
    std::function<Status()> before_commit = {};

    // Deflate level of ZIP and ZIPS, 0 (stored) to 9. Time and size by level:
    // docs/performance.md.
    static constexpr int kZipLevel = 1;
};

struct WriteReport {
    uint64_t overflow_pixels = 0;    // clamped
    uint64_t nonfinite_pixels = 0;   // NaN or Inf; also clamped in color, kept in planes
    uint64_t bytes = 0;              // size of the file
    std::vector<std::string> notes;  // changes other than color
};

}  // namespace postchain::io
