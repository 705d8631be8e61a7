// The layers of a frame's color file: which are filtered along with color, which hold mattes, which
// stay as they are and why. From headers alone.
//
//   channels --config/layer_match--> color and data
//   "--layers", "--cryptomatte", "matte:" --find_frame_layers--> FrameLayers
//   FrameLayers --read_layers, read_mattes--> planes Role::layers, Role::mattes (chain/layers.h)
//
// Docs: docs/layers.md.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "chain/chain.h"
#include "config/layer_match.h"
#include "tools/sequence/frame/cryptomatte.h"
#include "tools/sequence/frame/frame_reader.h"

namespace postchain::sequence {

enum class CryptomatteChoice {
    keep,    // as rendered, bit for bit
    filter,  // the coverage of each id as a layer, then ranked anew
};

struct LayerSettings {
    std::string layers = "none";  // choose_layers()
    CryptomatteChoice cryptomatte = CryptomatteChoice::keep;
    std::vector<std::string> mattes;  // mattes_of() the chains
    io::PathHold hold;                // of the manifests' files; none: all are read
    io::ExrSettings written;          // what it takes is filtered, what is asked for
};

// What the passes name as their mattes, each once, in the order of the passes.
std::vector<std::string> mattes_of(const Chain& chain);
// Whether it is the coverage of ids, not a channel: "cryptomatte:hero".
bool is_matte_of_ids(const std::string& matte);
// FrameDescription::mattes of the chain, where the plane of mattes holds `mattes`.
std::vector<int> matte_indices(const Chain& chain, const std::vector<std::string>& mattes);

// One channel of 0..1, or the coverage of ids in cryptomattes.
struct MatteSource {
    std::string name;                                 // as the pass has it
    RoleChannels channel;                             // of color's file; none: of cryptomattes
    std::map<size_t, std::vector<io::CryptoId>> ids;  // sorted; by FrameLayers::cryptomattes
};

struct LeftLayer {
    std::string name;
    std::string why;
};

struct FrameLayers {
    std::vector<FileLayer> filtered;  // in the order of the plane Role::layers
    std::vector<LeftLayer> left;      // written back bit for bit
    std::vector<io::Cryptomatte> cryptomattes;
    size_t filtered_cryptomattes = 0;  // so many of them, the first
    std::vector<MatteSource> mattes;   // in the order of LayerSettings::mattes
    std::vector<std::string> warnings;

    // Whether Role::layers has anything to do here.
    bool any_filtered() const { return !filtered.empty() || filtered_cryptomattes > 0; }
    std::string text() const;  // what the filtered pixels follow from, for the fingerprint
};

// `data`: data_names() of the profile. Errors (usage, input), each naming the file:
// choose_layers(), a layer of another size, one with channels that cannot be filtered; a matte that
// is not there (nearest names) or that several channels or cryptomattes have; a cryptomatte with a
// fault that is to be filtered, or that alone could have a matte.
Result<FrameLayers> find_frame_layers(const LayerSettings& settings,
                                      const std::vector<std::string>& data,
                                      const io::PixelFile& file, const ProfileMatch& match);

// The filtered layers as stored, one below another, RGBA each (A is 0 where a layer has none).
// `input` was read with this area. Errors (input): damaged data.
Result<ImageF> read_layers(const FrameLayers& layers, const io::InputFrame& input,
                           const io::Window& area);

// The mattes in 0..1, one below another. What is no number counts as 0. `warnings` gets one line
// where ids that no manifest confirms are in no pixel. Errors (input): damaged data.
Result<ImageF> read_mattes(const FrameLayers& layers, const io::InputFrame& input,
                           const io::Window& area, std::vector<std::string>& warnings);

}  // namespace postchain::sequence
