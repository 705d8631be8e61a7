// The fingerprint of an output frame: a string that identifies what made it. Outputs of the same
// chain, settings and input files (with those of neighbors that are read) have the same
// fingerprint.
#pragma once

#include <string>

#include "chain/pass/chain.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::sequence {

// "postchain VERSION chain HASH work HASH".
std::string fingerprint_of(const Chain& chain, const RunSettings& settings,
                           const FrameToRead& opened);

// Provenance of an output (its attribute "postchain", its sidecar's "work"): the fingerprint, and
// whether RunSettings::strict was set.
std::string provenance_of(const std::string& fingerprint, bool strict);

// Provenance of a preview: the fingerprint of its output, and the view it shows.
std::string preview_provenance_of(const std::string& fingerprint, const RunSettings& settings);

// Reads all data. If only a few bytes are missing, all chunks may still begin inside the file.
// Errors (input): those of reading.
Status check_whole(io::ExrFile& file);

// Whether the output and the requested sidecar and preview exist, are complete and have this
// fingerprint (the preview: this view too). Under RunSettings::strict only outputs made with it
// count, because nothing else guarantees finite values.
bool is_done(const std::string& output, const std::string& fingerprint,
             const RunSettings& settings);

}  // namespace postchain::sequence
