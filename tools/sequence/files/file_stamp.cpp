#include "tools/sequence/files/file_stamp.h"

#include <filesystem>

namespace postchain::io {

namespace fs = std::filesystem;

FileStamp FileStamp::of(const std::string& path) {
    std::error_code error;
    FileStamp stamp;
    stamp.path = path;
    stamp.bytes = fs::file_size(path, error);
    stamp.time = fs::last_write_time(path, error).time_since_epoch().count();
    return stamp;
}

Status FileStamp::unchanged() const {
    std::error_code error;
    if (!fs::exists(path, error))
        return Status(StatusCode::input,
                      path + ": was removed while it was in use; the result is not written");
    const FileStamp now = of(path);
    if (now == *this) return Status();
    return Status(StatusCode::input,
                  concat(path, ": was changed while it was in use (",
                         now.bytes == bytes ? std::string("another time of change")
                                            : concat(bytes, " bytes before, ", now.bytes, " now"),
                         "); the result is not written, run the command again"));
}

Status check_unchanged(const std::vector<FileStamp>& stamps) {
    for (const FileStamp& stamp : stamps) RETURN_IF_ERROR(stamp.unchanged());
    return Status();
}

}  // namespace postchain::io
