// Chain files: YAML or JSON text -> Chain. Format: docs/chain_file.md.
//
//   postchain: 1
//   camera: {focal_length_mm: 50, f_stop: 1.8}
//   passes:
//     - motion_blur: {samples: 25}
//     - fxaa                          # a bare name: all defaults
//
// Keys, types and ranges come from the passes' parameter tables and camera_parameters(). The parser
// does not depend on any pass.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "chain/pass/chain.h"
#include "config/diagnostic.h"
#include "config/text_tree.h"

namespace postchain {

inline constexpr int kChainFileVersion = 1;

// Parameters that every pass takes in addition to its own: members of a ChainLink.
const ParameterTable& link_parameters();

struct ChainFile {
    Chain chain;  // without the faulty parts; run it only if status() is ok
    std::string file_name;
    Diagnostics diagnostics;

    // StatusCode::chain if the file is invalid, StatusCode::usage if only overrides are.
    Status status() const { return status_of(diagnostics); }
};

// `overrides` are the arguments of --set: "passes[0].samples=51" (the path that errors print),
// "motion_blur.samples=51" (for a pass that is in the chain once), "camera.f_stop=2"; "=null"
// unsets. They take precedence over all other values: an override of a camera value unsets the
// passes' own parameters of that name (with a note). A later override of the same path wins.
ChainFile parse_chain(std::string_view text, const std::string& file_name,
                      const PassRegistry& registry, const std::vector<std::string>& overrides = {});
// A chain inside another text that has been read.
ChainFile parse_chain(const TextNode& root, const std::string& file_name,
                      const PassRegistry& registry, const std::vector<std::string>& overrides = {});

// A chain file that parses to the same chain (same hash). Defaults are written too.
std::string write_chain(const Chain& chain);

}  // namespace postchain
