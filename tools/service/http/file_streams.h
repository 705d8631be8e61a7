// Files in replies, read while they are sent.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/service/http/message.h"
#include "tools/service/work/service.h"

namespace postchain::service {

struct FilePart {
    uint64_t begin = 0, end = 0;  // bytes
};

Reply file_reply(const ResultFile& file);
Reply parts_reply(const ResultFile& file, const std::vector<FilePart>& parts);  // one after another
Reply download_reply(const ResultFile& file);  // with the file's name

}  // namespace postchain::service
