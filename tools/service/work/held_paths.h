// The paths of a request, held under the roots: which of its texts name files, and how a pattern of
// frames is held.
#pragma once

#include <string>

#include "chain/parameter.h"
#include "tools/sequence/files/sequence.h"
#include "tools/sequence/frame/cryptomatte.h"
#include "tools/service/work/roots.h"

namespace postchain::service {

// How a text of the tables names files.
enum class PathKind {
    none,     // a text of another kind
    file,     // a file or folder
    profile,  // a name, or a file
    input,    // patterns of frames, one or one for each plane
    output,   // a pattern of frames
};
PathKind path_kind(const Parameter& row);

// A word for a shipped thing, not a file.
bool is_word(const std::string& text);
std::string joined_path(const std::string& folder, const std::string& name);

// What frames name besides, as manifests of cryptomattes: read under these roots alone.
io::PathHold hold_of(const Roots& roots);

// The pattern with its folder resolved; without a token the whole path. Errors: those of
// Roots::resolve().
Result<io::PathPattern> resolve_pattern(const io::PathPattern& pattern, const Roots& roots);

// Every file that the patterns find lies under the roots, links resolved; of an input also the
// frames that are not asked for, which are neighbors. Errors (input): the first that does not.
Status check_inputs(const io::InputSpec& input, const Roots& roots);
// The folder lies under the roots now. Errors (output).
Status check_folder(const std::string& folder, const Roots& roots);

}  // namespace postchain::service
