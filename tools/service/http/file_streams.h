// Files in replies, read while they are sent.
#pragma once

#include <string>
#include <vector>

#include "tools/service/http/message.h"
#include "tools/service/work/service.h"

namespace postchain::service {

Reply file_reply(const ResultFile& file);
Reply download_reply(const ResultFile& file);  // with the file's name
// An archive of the files, not compressed, in their order.
Reply zip_reply(const std::vector<ResultFile>& files, const std::string& name);

}  // namespace postchain::service
