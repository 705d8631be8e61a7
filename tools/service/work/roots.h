// The folders of a service. Every path of a job is resolved and must be inside one of them.
#pragma once

#include <string>
#include <vector>

#include "chain/base/status.h"
#include "tools/sequence/files/sequence.h"

namespace postchain::service {

class Roots {
  public:
    // Errors (usage): empty list, or a folder that does not exist or is a file.
    static Result<Roots> of(const std::vector<std::string>& folders);

    // These folders alone, for a user: each must be in a root. Paths stay relative to the first
    // root.
    Result<Roots> within(const std::vector<std::string>& folders) const;

    // The absolute path without links. Relative paths start at the first root. The file and the
    // folder of an output need not exist. Errors: (input) outside the roots; (usage) empty, a zero
    // byte, longer than PATH_MAX, a part longer than NAME_MAX. The message shows only `path` as
    // given.
    Result<std::string> resolve(const std::string& path) const;
    // The form of an absolute path in replies: "shots/a.0001.exr" in the first root, the absolute
    // path in other roots. A request may use it again.
    std::string shown(const std::string& path) const;
    // shown() for every path in a message; the first root itself becomes ".".
    std::string shown_in(std::string text) const;

    const std::vector<std::string>& folders() const { return folders_; }
    // The folders that paths must be in: a user's, or all.
    const std::vector<std::string>& entries() const { return within_.empty() ? folders_ : within_; }

  private:
    std::vector<std::string> folders_;  // absolute, resolved
    std::vector<std::string> within_;   // likewise, in these; empty = all
};

std::string joined_path(const std::string& folder, const std::string& name);

// The pattern with its folder resolved; a pattern without a token is resolved as a path. Errors:
// those of Roots::resolve().
Result<io::PathPattern> resolve_pattern(const io::PathPattern& pattern, const Roots& roots);

}  // namespace postchain::service
