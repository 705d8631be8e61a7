// Packs the chunks of one part on the threads of WorkerPool and writes them in order.
//
//   rows of the planes --> words split --> differences --> deflate --> the stream, a few at a time
#pragma once

#include <ImfIO.h>

#include <cstdint>
#include <optional>
#include <vector>

#include "chain/status.h"
#include "tools/sequence/exr/exr_chunk_layout.h"
#include "tools/sequence/exr/exr_internal.h"

namespace postchain::io {

// Appends all chunks of the full-size level. `planes`: one for each channel of the layout, in any
// order. `part`: part number, only for multi-part files. `level`: deflate level (zlib_stream.h).
// Returns the table of chunks: the file offset of each. Errors (output): a chunk of 2 GiB or more;
// (memory). Throws the exceptions of the stream.
Result<std::vector<uint64_t>> write_chunks(Imf::OStream& stream, const ChunkLayout& layout,
                                           const PartPlanes& planes, std::optional<int> part,
                                           int level);

}  // namespace postchain::io
