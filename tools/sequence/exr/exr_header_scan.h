// Checks an EXR header before OpenEXR allocates anything for it.
//
// Source: "OpenEXR File Layout" (openexr.com): magic, version, headers of (name, type, size,
// value), chunk offset tables. Reads sizes only, and checks every count against the file.
#pragma once

#include <cstdint>
#include <vector>

#include "chain/status.h"

namespace postchain::io {

struct ReadLimits;

// Form of a part's chunks.
struct ChunkForm {
    bool known = true;  // OpenEXR reads parts of this type
    bool tiled = false;
    bool deep = false;
};

// Facts about a file that OpenEXR does not report.
struct HeaderFacts {
    bool multi_part = false;      // the file's flag; such a file may have one part
    bool type_attribute = false;  // the first part has a type; optional in a single flat part
    // The chunk offsets of each part, all within the file. 0: never written.
    std::vector<std::vector<uint64_t>> chunks;
    std::vector<ChunkForm> forms;      // one for each part
    std::vector<uint64_t> flattening;  // of each deep part: flattening_bytes() of its largest chunk
};

// `fd` is a regular file of `file_bytes` bytes. Errors (input), without the path: zero bytes, not
// an EXR, truncated (the file ends in its header or before a chunk), above `limits`, more pixels
// than a file of this size can hold, contradictory sizes.
Result<HeaderFacts> scan_header(int fd, uint64_t file_bytes, const ReadLimits& limits);

}  // namespace postchain::io
