// The page at / and the files that it loads, embedded in the program.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace postchain::service {

struct PageFile {
    std::string address;    // "/", "/page/main.js"
    std::string type;       // "text/javascript; charset=utf-8"
    std::string operation;  // operationId of its address
    std::string what;       // one line
    std::string_view text;
};
const std::vector<PageFile>& page_files();

}  // namespace postchain::service
