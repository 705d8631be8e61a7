// The folders that a service reads from and writes to. Every path of a job is resolved and must lie
// in one of them.
#pragma once

#include <string>
#include <vector>

#include "chain/status.h"

namespace postchain::service {

class Roots {
  public:
    // Errors (usage): no folder, or none that is there.
    static Result<Roots> of(const std::vector<std::string>& folders);

    // The path of a job, absolute and without links: relative ones are taken from the first root.
    // The file, and of an output its folder, need not be there yet. Errors (usage): outside, a zero
    // byte, longer than PATH_MAX, a part longer than NAME_MAX. The message holds `path` as given
    // and nothing else of the file system.
    Result<std::string> resolve(const std::string& path) const;
    // "shots/a.0001.exr" of an absolute path in the first root: what answers show. Of another root
    // the whole path, which names the same file when it is given back.
    std::string shown(const std::string& path) const;
    // The same of every path in a message: the first root itself is ".".
    std::string shown_in(std::string text) const;

    const std::vector<std::string>& folders() const { return folders_; }

  private:
    std::vector<std::string> folders_;  // absolute, resolved
};

}  // namespace postchain::service
