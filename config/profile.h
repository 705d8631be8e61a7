// Profiles: which channels of an EXR mean what, for one writer. A profile is data
// (config/profiles/*.yaml, or a file of the user's), read here and matched with the channels of a
// file in profile_match.h. Conventions: docs/frame.md; format: docs/profiles.md.
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
    // Names of layers that hold data and no color, with * and ? as in file names, in any case.
    // Empty: those of the profile `generic`.
    std::vector<std::string> data;
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

}  // namespace postchain
