#include "tools/service/page/page.h"

#include "tools/page/page.h"

namespace postchain::service {

const std::vector<PageFile>& page_files() {
    static const std::vector<PageFile> files = {
        {"/", "text/html; charset=utf-8", "getPage", "The page", page::file("service/index.html")},
        {"/page/style.css", "text/css; charset=utf-8", "getPageStyle", "Its style",
         page::file("service/style.css")},
        {"/page/icon.svg", "image/svg+xml", "getPageIcon", "Its icon",
         page::file("service/icon.svg")},
        {"/page/main.js", "text/javascript; charset=utf-8", "getPageScript", "Its script",
         page::file("service/main.js")}};
    return files;
}

}  // namespace postchain::service
