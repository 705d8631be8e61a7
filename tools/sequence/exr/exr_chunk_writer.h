// The chunks of one part, packed on the threads of WorkerPool and written in their order.
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

// Appends all chunks of the full size. `planes`: one for each channel of the layout, in any order;
// `part`: the number that chunks of a multi-part file begin with; `level`: of deflate
// (zlib_stream.h). Returns the table: where each chunk begins. Errors (output): a chunk of 2 GiB;
// (memory). Throws what the stream throws.
Result<std::vector<uint64_t>> write_chunks(Imf::OStream& stream, const ChunkLayout& layout,
                                           const PartPlanes& planes, std::optional<int> part,
                                           int level);

}  // namespace postchain::io
