// The page of a report in parts: its pictures are sent when they are looked at, not with the page.
#pragma once

#include <string>

#include "chain/status.h"

namespace postchain::service {

// The page without its pictures. Errors (input): the file cannot be read.
Result<std::string> page_without_pictures(const std::string& path);
// The text of a picture in the page, as tools/page/viewer/picture.js decodes it. Errors (input):
// the file cannot be read, or has no such picture.
Result<std::string> picture_in_page(const std::string& path, const std::string& id);

}  // namespace postchain::service
