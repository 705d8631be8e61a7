#include "tools/service/page/page.h"

#include "shaders/embedded.h"

namespace postchain {
// Made from the files beside this.
const std::vector<EmbeddedFile>& embedded_service_page();
}  // namespace postchain

namespace postchain::service {
namespace {

PageFile page_file(const EmbeddedFile& file) {
    const std::string path(file.path);
    if (path == "index.html") return {"/", "text/html; charset=utf-8", "The page", file.text};
    if (path.ends_with(".css"))
        return {"/page/" + path, "text/css; charset=utf-8", "Its style", file.text};
    if (path.ends_with(".svg")) return {"/page/" + path, "image/svg+xml", "Its icon", file.text};
    return {"/page/" + path, "text/javascript; charset=utf-8", "A script of it", file.text};
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

}  // namespace postchain::service
