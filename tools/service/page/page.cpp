#include "tools/service/page/page.h"

#include "shaders/embedded.h"

namespace postchain {

const std::vector<EmbeddedFile>& embedded_service_page();  // made from the files beside this

namespace service {
namespace {

PageFile page_file(const EmbeddedFile& file) {
    const std::string path(file.path);
    if (path == "index.html") return {"/", "text/html; charset=utf-8", "The page", file.text};
    const bool style = path.ends_with(".css");
    return {"/page/" + path, style ? "text/css; charset=utf-8" : "text/javascript; charset=utf-8",
            style ? "Style of the page" : "Script of the page", file.text};
}

}  // namespace

const std::vector<PageFile>& page_files() {
    static const std::vector<PageFile> files = [] {
        std::vector<PageFile> made;
        for (const EmbeddedFile& file : embedded_service_page()) made.push_back(page_file(file));
        return made;
    }();
    return files;
}

}  // namespace service
}  // namespace postchain
