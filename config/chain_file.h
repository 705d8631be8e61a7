// Chain files: YAML or JSON text -> Chain. Format: docs/chain_file.md.
//
//   postchain: 1
//   camera: {focal_length_mm: 50, f_stop: 1.8}
//   passes:
//     - motion_blur: {samples: 25}
//     - fxaa                          # a bare name: all defaults
//
// Which keys exist, their types and ranges come from the passes' parameter tables and
// camera_parameters(); this file knows no pass.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "chain/chain.h"
#include "config/diagnostic.h"

namespace postchain {

inline constexpr int kChainFileVersion = 1;

// What every pass may state besides its own parameters: members of a ChainLink.
const ParameterTable& link_parameters();

struct ChainFile {
    Chain chain;  // what could be read; run it only when status() is ok
    std::string file_name;
    Diagnostics diagnostics;

    // StatusCode::chain when the file is invalid, StatusCode::usage when only overrides are.
    Status status() const { return status_of(diagnostics); }
};

// `overrides` are the texts of --set: "passes[0].samples=51" (the path that errors print),
// "motion_blur.samples=51" (the pass must be there once), "camera.f_stop=2"; "=null" unsets. They
// take precedence over everything: setting a camera value unsets the parameters of the same name
// that passes set for themselves (with a note). A later override of the same path wins.
ChainFile parse_chain(std::string_view text, const std::string& file_name,
                      const PassRegistry& registry, const std::vector<std::string>& overrides = {});

// A chain file that parses to the same chain (same hash): every parameter is written, also where
// it is the default.
std::string write_chain(const Chain& chain);

}  // namespace postchain
