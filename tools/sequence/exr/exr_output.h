// Writes EXR files: header and tables by OpenEXR, chunks by exr_chunks.h or OpenEXR.
//
//   OpenEXR: magic, headers, tables without entries
//     copied parts        chunk by chunk as stored (copyPixels)
//     encoded parts       ZIP, ZIPS, none: write_chunks(), then the table is filled in
//                         others: OpenEXR
#pragma once

#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfMultiPartInputFile.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "tools/sequence/exr/exr_internal.h"
#include "tools/sequence/exr/exr_reader.h"
#include "tools/sequence/exr/exr_settings.h"
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

// Checks whether `settings` fit these parts, whose color is in the channels `color` of part
// `color_part`. Returns notes for the user, one line each. Errors (usage), without the path: a name
// in ExrSettings::channels that matches no channel, no color channel left, only some channels of
// another part selected, compression that would change float or integer channels other than color.
Result<std::vector<std::string>> check_settings(const std::vector<ExrPart>& parts, int color_part,
                                                const std::vector<std::string>& color,
                                                const ExrSettings& settings);

// Changes the header of the color part: keeps the channels to write, makes float color channels
// half if ExrSettings::half is set, and sets the compression.
void apply_settings(const ExrSettings& settings, const std::vector<std::string>& color,
                    Imf::Header& header);

// Indices of the parts with at least one channel to write.
std::vector<int> written_parts(const std::vector<ExrPart>& parts, const ExrSettings& settings);

}  // namespace postchain::io
