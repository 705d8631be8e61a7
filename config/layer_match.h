// Which layers a file has besides the color that is filtered, and which of them are color.
//
//   channels of all parts --view--> names up to the last dot --> FileLayer: color or data
//   layers + "Combined_key,Combined_f*" --choose_layers--> those to filter
#pragma once

#include <string>
#include <vector>

#include "config/profile_match.h"

namespace postchain {

// Channels whose names differ in the last word only. What a role of the frame is made of is none.
struct FileLayer {
    std::string name;  // "ViewLayer.Combined_key"; a channel without a dot is a layer of its own
    RoleChannels channels;  // in the file; of color R G B [A], whatever the letters
    std::string data;       // why it is no color: "is named as data (*normal)"; empty: it is color

    bool is_color() const { return data.empty(); }
};

// Names of layers that hold data: `profile`'s own list, else that of the profile `generic`.
const std::vector<std::string>& data_names(const Profile& profile);

// In the order of the parts and, in each, of the channels. `data` are patterns for the last word of
// a layer's name.
std::vector<FileLayer> find_layers(const FileChannels& file, const ProfileMatch& match,
                                   const std::vector<std::string>& data);

// Indices into `layers`, sorted. `choice`: "none", "all" (color layers of the view layer that the
// color is from; all where that has no name), or names and patterns with * and ?, comma between
// them. A name is a layer's whole name or its last words ("Combined_key"). Errors (usage): no such
// layer (the nearest names), several of one name (where they are), a layer of data.
Result<std::vector<size_t>> choose_layers(const std::vector<FileLayer>& layers,
                                          const std::string& choice, const std::string& color);

// "a, b" -> {"a", "b"}: without spaces at the ends of each.
std::vector<std::string> words_of_list(const std::string& text);

}  // namespace postchain
