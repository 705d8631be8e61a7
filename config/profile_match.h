// Which channels of a file hold which plane, by one profile or by the first that fits.
//
//   channels of all parts --view--> names --patterns--> role -> part, channels + ConvertOptions
//
// View first: a channel belongs to a view by its part's attribute, or by the word before its last
// one (OpenEXR's multi-view names, layer.view.channel), which is then left out of its name. Then
// layer: patterns with <layer> offer layers, patterns without it the unnamed one.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/profile.h"

namespace postchain {

// What an image file has.
struct PartChannels {
    std::string name;  // of the part; empty in a file with one unnamed part
    std::string view;  // attribute "view" of the part; empty = none
    std::vector<std::string> channels;
};
struct FileChannels {
    std::vector<PartChannels> parts;
    std::vector<std::string> views;  // attribute "multiView": the first is the default one
};

// A channel as a view has it.
struct ViewChannel {
    int part = 0;
    std::string name;     // without the view; of a part with a name it begins with that
    std::string channel;  // in the file
};
// Those of one view, empty = the only or default one, part by part.
std::vector<ViewChannel> channels_in_view(const FileChannels& file, const std::string& view);

struct RoleChannels {
    int part = 0;
    std::vector<std::string> channels;  // names in the file, in the role's order; color: 3 or 4
    bool operator==(const RoleChannels&) const = default;
};

struct ProfileMatch {
    std::string profile;
    bool detected = false;  // chosen by detection, not by name
    std::string why;        // "channels ViewLayer.Vector.X, ..." or "named"
    std::string layer;      // empty = the unnamed layer
    std::string view;       // empty = the only or default one
    std::map<Role, RoleChannels> roles;
    std::map<Role, std::string> missing;  // role -> the names that were looked for
    ConvertOptions options;               // origin_x, origin_y are the caller's
    std::vector<std::string> layers;      // with color in this view, as found; "" = the unnamed one
    std::vector<std::string> views;
    std::vector<std::string> notes;
    std::string text() const;  // several lines
};

// Which roles the file has by this profile; a role it lacks, color too, is in `missing` and for
// the caller to judge (planes may come from separate files). `layer` and `view`: the user's
// choice, empty = none. Without a choice the unnamed layer counts, else the one with color and the
// most roles. Errors: StatusCode::input when no role is found (what was looked for and found is
// listed), or several layers are equally good (they are listed); StatusCode::usage for a layer or
// view that does not exist (those that do are listed).
Result<ProfileMatch> match_profile(const Profile& profile, const FileChannels& file,
                                   const std::string& layer = {}, const std::string& view = {});

// The first of `profiles` whose detect_channels are there.
Result<ProfileMatch> detect_profile(const std::vector<Profile>& profiles, const FileChannels& file,
                                    const std::string& layer = {}, const std::string& view = {});

}  // namespace postchain
