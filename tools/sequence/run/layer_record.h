// What is said of a frame's further layers: in the sidecar and in plans.
#pragma once

#include <string>
#include <vector>

#include "tools/sequence/files/json.h"
#include "tools/sequence/run/cryptomatte_filter.h"
#include "tools/sequence/run/frame_layers.h"

namespace postchain::sequence {

// An object with `filtered`, `left`, `cryptomattes` and `mattes`, each only where there are any.
// Docs: docs/sidecar.md.
io::Json layers_json(const FrameLayers& layers, const std::vector<CryptomatteReport>& filtered);

// Lines for people; empty where the file has no further layers.
std::string layers_text(const FrameLayers& layers);

}  // namespace postchain::sequence
