// The fingerprint of an output frame: a text that says what made it. Two outputs of the same
// chain, settings and input files, those of its neighbors among them where they are read, have the
// same one.
#pragma once

#include <string>

#include "chain/chain.h"
#include "tools/sequence/run/run_settings.h"
#include "tools/sequence/run/sequence_reader.h"

namespace postchain::sequence {

// "postchain VERSION chain HASH work HASH": the output's "postchain" attribute and its sidecar's
// "work".
std::string fingerprint_of(const Chain& chain, const RunSettings& settings,
                           const FrameInputs& inputs);

// Output, sidecar and preview are there, whole and with this fingerprint.
bool is_done(const std::string& output, const std::string& fingerprint,
             const RunSettings& settings);

}  // namespace postchain::sequence
