// Extra layers of a file, beside the color that is filtered: which exist, and which are color.
//
//   channels of all parts --view--> names up to the last dot --> FileLayer: color or data
//   layers + "Combined_key,Combined_f*" --choose_layers--> those to filter
#pragma once

#include <string>
#include <vector>

#include "config/profile_match.h"

namespace postchain {

// Channels whose names differ only in the last word, without those of the frame's roles.
struct FileLayer {
    std::string name;  // "ViewLayer.Combined_key"; a channel without a dot is a layer of its own
    RoleChannels channels;  // names in the file; of color in the order R G B [A]
    std::string data;       // why it is data: "is named as data (*normal)"; empty = it is color

    bool is_color() const { return data.empty(); }
};

// Names of data layers: the list of `profile`, or of the profile `generic` if it has none.
const std::vector<std::string>& data_names(const Profile& profile);

// In the order of parts and channels. `data`: patterns for the last word of a layer's name.
std::vector<FileLayer> find_layers(const FileChannels& file, const ProfileMatch& match,
                                   const std::vector<std::string>& data);

// Indices into `layers`, sorted. `choice`: "none", "all" (all color layers of the view layer of the
// color, or of the file if that has no name), or comma-separated names and patterns with * and ?. A
// name is a layer's whole name or its last words ("Combined_key"). Errors (usage): unknown layer
// (with the closest names), several layers of one name (with their places), a data layer, "none"
// with other names.
Result<std::vector<size_t>> choose_layers(const std::vector<FileLayer>& layers,
                                          const std::string& choice, const std::string& color);

// "tree_*": the characters *, ?, [ make a pattern.
bool is_pattern(const std::string& word);

// "a, b" -> {"a", "b"}: words without leading and trailing spaces.
std::vector<std::string> words_of_list(const std::string& text);

}  // namespace postchain
