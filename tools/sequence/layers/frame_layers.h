// Classifies the layers of a frame's color file from headers: filtered with color, holding mattes,
// or left unchanged and why.
//
//   channels --config/layer_match--> color and data
//   "--aovs", "--cryptomatte", "matte:" --find_frame_layers--> FrameLayers
//   FrameLayers --read_layers, read_mattes--> planes Role::layers, Role::mattes
//
// Docs: docs/layers.md.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "chain/pass/chain.h"
#include "config/layer_match.h"
#include "tools/sequence/planes/cryptomatte.h"
#include "tools/sequence/planes/frame_reader.h"

namespace postchain::sequence {

enum class CryptomatteChoice {
    keep,    // as rendered, bit for bit
    filter,  // coverage of each id as a layer, then re-ranked
};

struct LayerSettings {
    std::string aovs = "none";  // choose_layers()
    bool only_present = false;  // of them: names without a layer that can be filtered are left out
    CryptomatteChoice cryptomatte = CryptomatteChoice::keep;
    std::vector<std::string> ids;     // to filter: names and patterns; empty = all
    std::vector<std::string> mattes;  // mattes_of() the chains
    io::PathCheck manifest_check;     // check of the manifest files; none = all are read
    io::ExrSettings written;          // only layers that it writes are filtered
    std::string fill_mask;            // layers/fill_mask.h; empty = none
};

// The mattes named by the passes, each once, in the order of the passes.
std::vector<std::string> mattes_of(const Chain& chain);
// Whether it names the coverage of ids, "cryptomatte:hero", instead of a channel.
bool is_matte_of_ids(const std::string& matte);
// FrameDescription::mattes of the chain for a matte plane that holds `mattes`.
std::vector<int> matte_indices(const Chain& chain, const std::vector<std::string>& mattes);

// One channel of 0..1, or the coverage of ids in cryptomattes.
struct MatteSource {
    std::string name;      // as the pass names it
    RoleChannels channel;  // in color's file; none = from cryptomattes
    std::map<size_t, std::vector<io::CryptoId>>
        ids;  // sorted; by index in FrameLayers::cryptomattes
};

struct LeftLayer {
    std::string name;
    std::string why;
};

struct FrameLayers {
    std::vector<FileLayer> filtered;  // in the order of the plane Role::layers
    std::vector<LeftLayer> left;      // written back bit for bit
    std::vector<io::Cryptomatte> cryptomattes;
    size_t filtered_cryptomattes = 0;  // the first ones in `cryptomattes`
    // Sorted, by index in `cryptomattes`; none: all ids. Other ids are removed.
    std::map<size_t, std::vector<io::CryptoId>> filtered_ids;
    std::vector<MatteSource> mattes;  // in the order of LayerSettings::mattes
    std::string fill_mask;            // with the view, if its part has channels of others
    std::vector<std::string> warnings;

    bool any_filtered() const { return !filtered.empty() || filtered_cryptomattes > 0; }
    std::string text() const;  // decides the filtered pixels; part of the fingerprint
};

// `data`: data_names() of the profile. Errors (usage, input), each naming the file: those of
// choose_layers(); a layer of another size or with channels that cannot be filtered; a matte that
// does not exist (with the closest names) or is in several channels or cryptomattes; a faulty
// cryptomatte that is to be filtered or is the only one that could contain a matte; a fill mask
// whose channels color's part has.
Result<FrameLayers> find_frame_layers(const LayerSettings& settings,
                                      const std::vector<std::string>& data,
                                      const io::PixelFile& file, const ProfileMatch& match);

// The filtered layers as stored, stacked, RGBA each (A = 0 if a layer has none). `file`: color's,
// of which `read` was read. Errors (input): damaged data.
Result<ImageF> read_layers(const FrameLayers& layers, io::PixelFile& file,
                           const io::StoredFrame& read);

// Faults in the pixels of mattes and cryptomattes.
struct MatteFindings {
    uint64_t faulty = 0;  // values
    std::vector<std::string> warnings;

    // Once for each text.
    void add(uint64_t values, const std::string& warning);
    void add_cryptomatte(const std::string& path, const io::Cryptomatte& cryptomatte,
                         const io::RankedCoverage& ranks);
};

// The mattes in 0..1, stacked; NaN is read as 0. A warning says if no pixel has ids that no
// manifest confirms. Errors (input): damaged data.
Result<ImageF> read_mattes(const FrameLayers& layers, io::PixelFile& file,
                           const io::StoredFrame& read, MatteFindings& findings);

}  // namespace postchain::sequence
