// A first look at an EXR file, before OpenEXR allocates anything for it.
//
// Source: "OpenEXR File Layout" (openexr.com): magic, version, headers of (name, type, size,
// value), chunk offset tables. Reads sizes only; every count is checked against the file.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "chain/status.h"

namespace postchain::io {

struct ReadLimits;

// How the chunks of a part are laid out.
struct ChunkForm {
    bool known = true;  // a kind of part that OpenEXR reads
    bool tiled = false;
    bool deep = false;
};

// What OpenEXR does not tell of a file it has opened.
struct HeaderFacts {
    bool multi_part = false;      // the flag; such a file may have one part
    bool type_attribute = false;  // of the first part: optional in a single flat part
    // Of each part, where its chunks begin, each before the file's end. 0: never written.
    std::vector<std::vector<uint64_t>> chunks;
    std::vector<ChunkForm> forms;  // of each part
};

// `fd` is a regular file of `file_bytes` bytes. Errors (input), without the path: zero bytes, not
// an EXR, truncated (the header ends early, or a chunk lies behind the end), more than `limits`
// allow, more pixels than such a file can hold, contradictory sizes.
Result<HeaderFacts> scan_header(int fd, uint64_t file_bytes, const ReadLimits& limits);

}  // namespace postchain::io
