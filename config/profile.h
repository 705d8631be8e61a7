// Profiles: the meaning of EXR channels, per writer. A profile is a file (config/profiles/*.yaml,
// or the user's own) that is read here and matched with a file's channels in profile_match.h.
// Conventions: docs/frame.md. Format: docs/profiles.md.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "chain/frame/convert.h"
#include "chain/frame/role.h"
#include "config/diagnostic.h"

namespace postchain {

// One way to store a role: channel names in the role's order. A leading "<layer>" matches any layer
// name, dots included; the rest of a name is literal.
using ChannelPattern = std::vector<std::string>;

inline constexpr std::string_view kLayer = "<layer>";

// Patterns that share one convention. Each role uses only its own members.
struct RoleSource {
    std::vector<ChannelPattern> channels;         // the first complete one is used
    bool unpremultiplied = false;                 // color
    DepthEncoding depth = DepthEncoding::linear;  // inverse_depth
    MotionConvention motion;                      // motion, motion_back
};

struct Profile {
    std::string name;
    std::string title;
    std::string verified;  // verified parts and how; printed with the match
    int priority = 0;      // detection tries larger values first
    // The file is from this writer if one of these patterns is complete. Empty: any file.
    std::vector<ChannelPattern> detect_channels;
    // In the order of the trials. Color may lack alpha, which then is 1.
    std::map<Role, std::vector<RoleSource>> roles;
    std::vector<std::string> notes;  // printed with the match
    // Name patterns of data layers, with * and ?, case-insensitive. Empty: those of the profile
    // `generic`.
    std::vector<std::string> data;
};

struct ProfileFile {
    Profile profile;
    Diagnostics diagnostics;
    Status status() const { return status_of(diagnostics); }
};
// Errors are StatusCode::usage.
ProfileFile parse_profile(std::string_view text, const std::string& file_name);

// The profiles inside the program, in the order of detection.
const std::vector<Profile>& builtin_profiles();
// A built-in profile by name, or a file (a name with '/' or '.'). StatusCode::usage for an unknown
// name; the message lists the known names.
Result<Profile> find_profile(const std::string& name_or_path);

}  // namespace postchain
