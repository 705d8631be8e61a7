// Reads a deep part as a flat one.
//
//   table of chunks --> pread, sizes checked --> unpack --> samples of a pixel --DeepPixel-->
//   planes
//
// One line or tile of samples is in memory for each thread of WorkerPool, never a whole part. The
// file is checked as in exr_chunks.h: sample counts grow along a line and add up to the
// stated number of bytes.
#pragma once

#include "chain/base/status.h"
#include "tools/sequence/exr/exr_chunks.h"
#include "tools/sequence/exr/exr_settings.h"
#include "tools/sequence/exr/pixel_file.h"

namespace postchain::io {

// `layout`: ChunkLayout::of_deep(). Fills the planes of `pixels`. A pixel without samples has color
// and all other values 0, and the depth 1e10 (half: infinity). Errors (input), with the lines or
// the tile: damaged, truncated; (memory).
Status read_deep_part(const ChunkSource& source, const ChunkLayout& layout, ExrMethod method,
                      const Flattening& flattening, PartPixels& pixels);

// Memory of one thread to flatten a chunk of `packed` bytes in the file and `unpacked` bytes of
// samples.
uint64_t flattening_bytes(uint64_t packed, uint64_t unpacked, uint64_t bytes_per_sample);

}  // namespace postchain::io
