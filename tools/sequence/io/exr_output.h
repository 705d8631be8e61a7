// The bytes of an EXR file: header and tables by OpenEXR, chunks by exr_chunk_writer or OpenEXR.
//
//   OpenEXR: magic, headers, tables without entries
//     parts that are copied        chunk by chunk as stored (copyPixels)
//     parts that are written       ZIP, ZIPS, none: exr_chunk_writer, then the table is filled in
//                                  others: OpenEXR
#pragma once

#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfMultiPartInputFile.h>

#include <map>
#include <vector>

#include "chain/status.h"
#include "tools/sequence/io/atomic_file.h"
#include "tools/sequence/io/exr_internal.h"

namespace postchain::io {

// Who has written the chunks. What OpenEXR has written is to be checked (check_complete()).
enum class Packer { own, openexr };

// Level and compression are those of the header. All throw what OpenEXR and the stream throw;
// errors (output, memory) as write_chunks().
Result<Packer> write_single_part(Imf::OStream& stream, const Imf::Header& header,
                                 const PartPlanes& planes);
// `planes`: of the parts that are written anew; the others are copied from `input`.
Result<Packer> write_multi_part(Imf::OStream& stream, const std::vector<Imf::Header>& headers,
                                const std::map<int, PartPlanes>& planes,
                                Imf::MultiPartInputFile& input);

// Whether every chunk has been written, asked of the file as a reader would. OpenEXR 3.1 writes
// nothing of lines that it could not compress for want of memory, and says nothing either. Errors
// (memory), (output). Throws what OpenEXR throws.
Status check_complete(AtomicFile& file);

}  // namespace postchain::io
