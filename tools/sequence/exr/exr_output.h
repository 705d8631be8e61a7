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

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "chain/status.h"
#include "tools/sequence/exr/exr_internal.h"
#include "tools/sequence/exr/write_options.h"

namespace postchain::io {

// Who has written the chunks. What OpenEXR has written is checked once more.
enum class Packer { own, openexr };

// Level and compression are those of the header. All throw what OpenEXR and the stream throw;
// errors (output, memory) as write_chunks().
Result<Packer> write_single_part(Imf::OStream& stream, const Imf::Header& header,
                                 const PartPlanes& planes);
// The chunks of the only part of `input`, which has scan lines, as they are stored. (OpenEXR 3.1
// copies tiles of such a file from wherever its stream happens to stand.)
Result<Packer> copy_single_part(Imf::OStream& stream, const Imf::Header& header,
                                Imf::MultiPartInputFile& input);
// `planes`: of the parts that are written anew, by their place in `headers`; part i of the others
// is copied from part `from[i]` of `input`.
Result<Packer> write_multi_part(Imf::OStream& stream, const std::vector<Imf::Header>& headers,
                                const std::map<int, PartPlanes>& planes,
                                Imf::MultiPartInputFile& input, const std::vector<int>& from);

// Runs `write` on a stream into a new file at `path`, then commits. `write` may throw, and must
// have closed its OpenEXR objects when it returns. Errors (output): the path (see AtomicFile),
// write errors, those of `write` and of WriteOptions::before_commit; (memory).
Status write_exr_file(const std::string& path, const WriteOptions& options, WriteReport& report,
                      const std::function<Result<Packer>(Imf::OStream&)>& write);

}  // namespace postchain::io
