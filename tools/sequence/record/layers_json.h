// Describes a frame's extra layers in its sidecar and plan.
#pragma once

#include <string>
#include <vector>

#include "tools/sequence/files/json.h"
#include "tools/sequence/filter/cryptomatte_filter.h"
#include "tools/sequence/layers/frame_layers.h"

namespace postchain::sequence {

// An object with the keys `filtered`, `left`, `cryptomattes`, `mattes` and `fill_mask`, each
// omitted if empty. Docs: docs/sidecar.md.
io::Json layers_json(const FrameLayers& layers, const std::vector<CryptomatteReport>& filtered);

// Lines to read; empty if the file has no extra layers.
std::string layers_text(const FrameLayers& layers);

}  // namespace postchain::sequence
