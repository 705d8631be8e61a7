// Profiles: which channels of an EXR mean what, for one writer. A profile is data
// (config/profiles/*.yaml, or a file of the user's); this file reads it and matches it with the
// channels of a file. Conventions: docs/frame.md; format: docs/profiles.md.
//
//   channels of all parts --view--> names --patterns--> role -> part, channels + ConvertOptions
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "chain/convert.h"
#include "chain/role.h"
#include "config/diagnostic.h"

namespace postchain {

// One way a role may be stored: channel names in the role's order. A name is literal but for a
// leading "<layer>", which stands for any layer name (dots included).
using ChannelPattern = std::vector<std::string>;

// Patterns that share one convention; which members count depends on the role.
struct RoleSource {
    std::vector<ChannelPattern> channels;         // the first complete one counts
    bool unpremultiplied = false;                 // color
    DepthEncoding depth = DepthEncoding::linear;  // inverse_depth
    MotionConvention motion;                      // motion, motion_back
};

struct Profile {
    std::string name;
    std::string title;
    std::string verified;  // what of it has been verified, and how; printed with the match
    int priority = 0;      // the larger is asked first
    // A file is this writer's when one of these channel patterns is complete. Empty: any file.
    std::vector<ChannelPattern> detect_channels;
    // In the order in which they are tried. Color may leave out alpha (then it is 1).
    std::map<Role, std::vector<RoleSource>> roles;
    std::vector<std::string> notes;  // printed with the match
};

struct ProfileFile {
    Profile profile;
    Diagnostics diagnostics;
    Status status() const { return status_of(diagnostics); }
};
// Errors are StatusCode::usage.
ProfileFile parse_profile(std::string_view text, const std::string& file_name);

// The profiles inside the program, in the order in which detection asks them.
const std::vector<Profile>& builtin_profiles();
// A built-in profile by name, or a file (a name with '/' or '.'). StatusCode::usage when there is
// none; the message lists the names.
Result<Profile> find_profile(const std::string& name_or_path);

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
