// Size and modification time of a file, to notice changes.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "chain/base/status.h"

namespace postchain::io {

struct FileStamp {
    std::string path;
    uint64_t bytes = 0;
    int64_t time = 0;  // last modification, in ticks of std::filesystem's clock

    static FileStamp of(const std::string& path);
    bool operator==(const FileStamp&) const = default;
    // Errors (input): the file's size or time has changed, or it no longer exists.
    Status unchanged() const;
};

// The error of the first file that has changed.
Status check_unchanged(const std::vector<FileStamp>& stamps);

}  // namespace postchain::io
