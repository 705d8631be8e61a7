// Size and time of change of a file, to notice that it has changed since.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "chain/status.h"

namespace postchain::io {

struct FileStamp {
    std::string path;
    uint64_t bytes = 0;
    int64_t time = 0;  // of the last change, in ticks of std::filesystem's clock

    static FileStamp of(const std::string& path);
    bool operator==(const FileStamp&) const = default;
    // Errors (input): the file has another size or time now, or is gone.
    Status unchanged() const;
};

// The error of the first file that has changed.
Status check_unchanged(const std::vector<FileStamp>& stamps);

}  // namespace postchain::io
