// The paths of a request, kept under the roots: which settings name files, and how a pattern of
// frames is resolved.
#pragma once

#include <string>

#include "chain/parameter.h"
#include "tools/sequence/files/sequence.h"
#include "tools/sequence/frame/cryptomatte.h"
#include "tools/service/work/roots.h"

namespace postchain::service {

// How a setting names files.
enum class PathKind {
    none,     // it does not
    file,     // a file or folder
    profile,  // a name, or a file
    input,    // frame patterns: one, or one per plane
    output,   // a frame pattern
};
PathKind path_kind(const Parameter& row);

// The name of a shipped chain or profile, not of a file.
bool is_word(const std::string& text);
std::string joined_path(const std::string& folder, const std::string& name);

// For files that frames name, such as Cryptomatte manifests: read only under these roots.
io::PathHold hold_of(const Roots& roots);

// The pattern with its folder resolved; a pattern without a token is resolved as a path. Errors:
// those of Roots::resolve().
Result<io::PathPattern> resolve_pattern(const io::PathPattern& pattern, const Roots& roots);

// Checks that every file of the patterns is under the roots, with links resolved. Includes frames
// outside the requested range, because they may be neighbors. Errors (input): the first one
// outside.
Status check_inputs(const io::InputSpec& input, const Roots& roots);
// Checks that the folder still is under the roots. Errors (output).
Status check_folder(const std::string& folder, const Roots& roots);

}  // namespace postchain::service
