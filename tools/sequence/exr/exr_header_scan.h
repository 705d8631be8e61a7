// Checks an EXR header, and the sizes that it states, before OpenEXR allocates anything for it.
//
// Source: "OpenEXR File Layout" (openexr.com): magic, version, headers of (name, type, size,
// value), chunk offset tables. Reads sizes only, and checks every count against the file.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "tools/sequence/exr/exr_reader.h"

namespace postchain::io {

// The compression's highest ratio, decoded bytes for one byte of the file:
//
//   none   1      not packed
//   rle    64     a run of 128 bytes in two
//   zip(s) 1032   deflate: 258 bytes in two bits, one for the length, one for the distance
//   piz    454    a run of 255 values of two bytes in nine bits, one for its code, eight for it
//   pxr24  1376   deflate of three bytes for each float of four
//   b44(a) 11     a block of 16 halves in three bytes
//   dwaa/b 66048  deflate of a run of 128 bytes in two (alpha); its other methods give less
//
// 0 for a compression that OpenEXR 3.1 cannot read.
uint64_t most_packed(int compression);

// Lines that a compression packs together; 1 for an unknown one.
int lines_of_chunk(int compression);

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
    std::vector<uint64_t> flattening;  // by deep part: flattening_bytes() of its largest chunk
};

// `fd` is a regular file of `file_bytes` bytes. Errors (input), without the path: zero bytes, not
// an EXR, truncated (the file ends in its header or before a chunk), above `limits`, more pixels
// than a file of this size can hold, contradictory sizes.
Result<HeaderFacts> scan_header(int fd, uint64_t file_bytes, const ReadLimits& limits);

}  // namespace postchain::io
