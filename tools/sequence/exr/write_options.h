// How a file of pixels is written, and what came of it: for EXR and pictures alike.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "chain/status.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/exr/exr_settings.h"
#include "tools/sequence/files/atomic_file.h"

namespace postchain::io {

inline constexpr float kMaxHalf = 65504;

enum class HalfOverflow {
    refuse,  // an error that counts them
    clamp,   // to the largest value of the channel's type, counted
};

struct WriteOptions {
    OnExisting on_existing = OnExisting::fail;
    HalfOverflow overflow = HalfOverflow::refuse;
    int zip_level = kZipLevel;
    ExrSettings exr = {};  // of write_filtered()
    // Data window of color's part, grown outwards where its subsampled channels need that. The
    // file's own when not given.
    std::optional<Window> window = {};
    // String attributes of color's part ("postchain" -> version and chain hash).
    std::map<std::string, std::string> attributes = {};
    // Asked when all is written and the file has not got its name yet; an error ends it.
    std::function<Status()> before_commit = {};

    // Level of deflate for ZIP and ZIPS, 0 (stored) to 9. On the 25.8 MB of a 1280x720 Cycles frame
    // (4 half, 5 float channels), milliseconds on one core and size of what comes out:
    //
    //   level         1     2     4     5     6     9
    //   libdeflate  106   124   133   149   156   386 ms   8.26  8.31  8.25  8.19  8.17  8.14 MB
    //   zlib        204   215   263   301   348  1582      8.64  8.55  8.18  8.13  8.09  8.05
    //
    // Files at libdeflate's 1 are a hundredth larger than at OpenEXR's default, zlib's 4.
    static constexpr int kZipLevel = 1;
};

struct WriteReport {
    bool skipped = false;            // on_existing skip, and there was a file
    uint64_t overflow_pixels = 0;    // clamped
    uint64_t nonfinite_pixels = 0;   // NaN or Inf; in color clamped too, planes keep them
    uint64_t bytes = 0;              // of the file
    std::vector<std::string> notes;  // what was changed besides color
};

}  // namespace postchain::io
