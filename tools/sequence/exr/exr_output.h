// Writes EXR files: header and tables by OpenEXR, chunks by exr_chunk_writer or OpenEXR.
//
//   OpenEXR: magic, headers, tables without entries
//     copied parts        chunk by chunk as stored (copyPixels)
//     encoded parts       ZIP, ZIPS, none: exr_chunk_writer, then the table is filled in
//                         others: OpenEXR
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

// Writer of the chunks. Chunks by OpenEXR are checked again.
enum class Packer { own, openexr };

// The header sets compression and level. All three pass on exceptions of OpenEXR and the stream.
// Errors (output, memory): those of write_chunks().
Result<Packer> write_single_part(Imf::OStream& stream, const Imf::Header& header,
                                 const PartPlanes& planes);
// Copies the stored chunks of the only part of `input`, which must have scan lines: OpenEXR 3.1
// copies tiles of a single-part file from the wrong file position.
Result<Packer> copy_single_part(Imf::OStream& stream, const Imf::Header& header,
                                Imf::MultiPartInputFile& input);
// `planes`: the pixels of the parts to encode, by index in `headers`. Any other part i is copied
// from part `from[i]` of `input`.
Result<Packer> write_multi_part(Imf::OStream& stream, const std::vector<Imf::Header>& headers,
                                const std::map<int, PartPlanes>& planes,
                                Imf::MultiPartInputFile& input, const std::vector<int>& from);

// Runs `write` on a stream into a new file at `path`, then commits the file. `write` may throw, and
// must close its OpenEXR objects before it returns. Errors (output): the path (see AtomicFile),
// write errors, those of `write` and of WriteOptions::before_commit; (memory).
Status write_exr_file(const std::string& path, const WriteOptions& options, WriteReport& report,
                      const std::function<Result<Packer>(Imf::OStream&)>& write);

// Calls `write`, which may throw, unless a file at `path` exists already and is kept. Errors
// (output): the file exists and is not replaced; those of `write`.
template <class Write>  // Status(WriteReport&)
Result<WriteReport> write_unless_kept(const std::string& path, OnExisting on_existing,
                                      const Write& write) try {
    ASSIGN_OR_RETURN(const bool kept, skipped_already(path, on_existing));
    WriteReport report;
    report.skipped = kept;
    if (!kept) RETURN_IF_ERROR(write(report));
    return report;
} catch (...) {
    return status_of_exception(path);
}

}  // namespace postchain::io
