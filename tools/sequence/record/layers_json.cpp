#include "tools/sequence/record/layers_json.h"

#include <cstdio>
#include <map>

#include "chain/base/printable.h"
#include "chain/base/text.h"
#include "tools/sequence/layers/fill_mask.h"

namespace postchain::sequence {
namespace {

// "channel ViewLayer.mask.V", "ids 645d3bc4, 97e96e58 of ViewLayer.CryptoObject".
std::string source_text(const MatteSource& matte, const FrameLayers& layers) {
    if (!matte.channel.channels.empty()) return "channel " + matte.channel.channels[0];
    std::vector<std::string> parts;
    for (const auto& [cryptomatte, ids] : matte.ids) {
        std::vector<std::string> words;
        for (io::CryptoId id : ids) {
            char text[16];
            std::snprintf(text, sizeof(text), "%08x", unsigned(id));
            words.push_back(text);
        }
        parts.push_back("ids " + joined(words) + " of " + layers.cryptomattes[cryptomatte].name);
    }
    return joined(parts);
}

}  // namespace

io::Json layers_json(const FrameLayers& layers, const std::vector<CryptomatteReport>& filtered) {
    io::Json json = io::Json::object();
    for (const FileLayer& layer : layers.filtered) json["filtered"].push_back(layer.name);
    for (const LeftLayer& layer : layers.left)
        json["left"].push_back({{"name", layer.name}, {"why", layer.why}});
    for (const CryptomatteReport& one : filtered)
        json["cryptomattes"].push_back({{"name", one.name},
                                        {"ids", one.ids},
                                        {"removed", one.removed},
                                        {"planes", one.planes},
                                        {"pixels_short", one.pixels_short},
                                        {"largest_lost", one.largest_lost}});
    for (const MatteSource& matte : layers.mattes)
        json["mattes"].push_back({{"name", matte.name}, {"from", source_text(matte, layers)}});
    if (!layers.fill_mask.empty()) json["fill_mask"] = fill_mask_channels(layers.fill_mask);
    return json;
}

std::string layers_text(const FrameLayers& layers) {
    std::string text;
    if (layers.any_filtered()) {
        std::vector<std::string> names;
        for (const FileLayer& layer : layers.filtered) names.push_back(layer.name);
        for (size_t i = 0; i < layers.filtered_cryptomattes; ++i)
            names.push_back(concat(
                layers.cryptomattes[i].name, " (by id, ", layers.cryptomattes[i].ranks(), " ranks",
                layers.filtered_ids.count(i) ? ", only the ids asked for" : "", ")"));
        text += printable("extra layers filtered: " + joined(names)) + "\n";
    }
    std::map<std::string, std::vector<std::string>> left;  // by reason
    for (const LeftLayer& layer : layers.left) left[layer.why].push_back(layer.name);
    for (const auto& [why, names] : left)
        text += printable(concat("extra layers left unchanged: ", joined(names), ": ", why)) + "\n";
    for (const MatteSource& matte : layers.mattes)
        text += printable(concat("matte ", quoted(matte.name), ": ", source_text(matte, layers))) +
                "\n";
    if (!layers.fill_mask.empty())
        text += concat("fill mask: ", joined(fill_mask_channels(layers.fill_mask)), "\n");
    return text;
}

}  // namespace postchain::sequence
