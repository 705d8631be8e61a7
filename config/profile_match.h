// The channels of each plane in a file, by a given profile or by the first that matches.
//
//   channels of all parts --view--> names --patterns--> role -> part, channels + ConvertOptions
//
// First the view: of the part's attribute, or the word before the last in the channel's name
// (OpenEXR's multi-view names, layer.view.channel), which is then removed from it. Then the layer:
// candidates come from patterns with <layer>; patterns without it stand for the unnamed layer.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/profile.h"

namespace postchain {

// The channels of an image file.
struct PartChannels {
    std::string name;  // empty for the only, unnamed part of a file
    std::string view;  // the part's attribute "view"; empty = none
    std::vector<std::string> channels;
};
struct FileChannels {
    std::vector<PartChannels> parts;
    std::vector<std::string> views;  // attribute "multiView"; the first is the default
};

// A channel of one view.
struct ViewChannel {
    int part = 0;
    std::string name;     // without the view; begins with the name of a named part
    std::string channel;  // in the file
};
// Channels of one view (empty = the only or default one), in the order of the parts.
std::vector<ViewChannel> channels_in_view(const FileChannels& file, const std::string& view);

struct RoleChannels {
    int part = 0;
    std::vector<std::string> channels;  // names in the file, in the role's order; color: 3 or 4
    bool operator==(const RoleChannels&) const = default;
};

// Chosen as view: the first one with channels; the others are listed.
inline constexpr const char* kAllViews = "all";

struct ProfileMatch {
    std::string profile;
    bool detected = false;   // by detection, not by name
    std::string why;         // "channels ViewLayer.Vector.X, ..." or "named"
    std::string view_layer;  // empty = the unnamed view layer
    std::string view;        // empty = the only or default one
    std::map<Role, RoleChannels> roles;
    std::map<Role, std::string> missing;   // role -> the names searched for
    ConvertOptions options;                // without origin_x and origin_y
    std::vector<std::string> view_layers;  // candidates in this view; "" = the unnamed one
    std::vector<std::string> views;
    std::vector<std::string> other_views;  // kAllViews: views with channels, without `view`
    std::vector<std::string> notes;
    std::string text() const;  // several lines
};

// The roles that the file has by this profile. Absent roles, even color, are listed in `missing`:
// the caller may have them in separate files. `view_layer` and `view`: the user's choice, empty =
// none. Without a choice, the unnamed layer is used, otherwise the layer with color and the most
// roles. Errors: StatusCode::input if no role is found (lists the names searched for and found) or
// if several layers are equally good (lists them); StatusCode::usage for an unknown layer or view
// (lists the existing ones).
Result<ProfileMatch> match_profile(const Profile& profile, const FileChannels& file,
                                   const std::string& view_layer = {},
                                   const std::string& view = {});

// By the first of `profiles` whose detect_channels the file has.
Result<ProfileMatch> detect_profile(const std::vector<Profile>& profiles, const FileChannels& file,
                                    const std::string& view_layer = {},
                                    const std::string& view = {});

}  // namespace postchain
