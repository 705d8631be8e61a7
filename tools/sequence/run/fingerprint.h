// The fingerprint of an output frame: a text that says what made it. Two outputs of the same
// chain, settings and input files, those of its neighbors among them where they are read, have the
// same one.
#pragma once

#include <string>

#include "chain/chain.h"
#include "tools/sequence/run/run_settings.h"
#include "tools/sequence/run/sequence_reader.h"

namespace postchain::sequence {

// "postchain VERSION chain HASH work HASH".
std::string fingerprint_of(const Chain& chain, const RunSettings& settings,
                           const FrameInputs& inputs);

// The provenance of an output, its "postchain" attribute and its sidecar's "work": the fingerprint,
// and whether the frame was made under RunSettings::strict.
std::string provenance_of(const std::string& fingerprint, bool strict);

// The provenance of a preview: the fingerprint of its output, and the view that it shows.
std::string preview_provenance_of(const std::string& fingerprint, const RunSettings& settings);

// Output, sidecar and preview, as far as they are asked for, are there, whole and with this
// fingerprint, the preview with this view. Under
// RunSettings::strict only what was made so: nothing else says that its values are finite.
bool is_done(const std::string& output, const std::string& fingerprint,
             const RunSettings& settings);

}  // namespace postchain::sequence
