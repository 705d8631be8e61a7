#include "tools/service/http/report_parts.h"

#include <fstream>
#include <string_view>

#include "chain/base/readable_file.h"

namespace postchain::service {
namespace {

// As tools/measure/report/page/page.cpp writes them: each on a line of its own. A page may have
// hundreds of MB, so that only one of them is in memory.
constexpr std::string_view kBegin = "<script type=\"text/plain\" id=\"image-";
constexpr std::string_view kEnd = "</script>";

constexpr size_t kKeptPages = 8;

// Calls take(line with its line feed, its offset) for each line.
template <class Take>
Status read_lines(const std::string& path, const Take& take) {
    const ReadableFile opened(path);
    if (!opened.ok()) return Status(StatusCode::input, path + ": " + opened.fault());
    std::ifstream file(opened.path(), std::ios::binary);
    uint64_t at = 0;
    for (std::string line; file && std::getline(file, line); at += line.size()) {
        if (!file.eof()) line += '\n';
        take(line, at);
    }
    if (file.bad() || !file.is_open()) return Status(StatusCode::input, path + ": cannot be read");
    return Status();
}

}  // namespace

Result<std::string> page_without_pictures(const std::string& path) {
    std::string page;
    const Status status = read_lines(path, [&](const std::string& line, uint64_t) {
        if (!line.starts_with(kBegin)) page += line;
    });
    if (!status.ok()) return status;
    return page;
}

Result<std::string> PagePictures::get(const std::string& path, const std::string& id) {
    ASSIGN_OR_RETURN(const auto page, indexed(io::FileStamp::of(path)));
    const auto found = page->places.find(id);
    if (found == page->places.end())
        return Status(StatusCode::input, "the report does not have the picture '" + id + "'");
    const auto [at, bytes] = found->second;
    std::string picture(bytes, 0);
    const ReadableFile opened(path);
    if (!opened.ok()) return Status(StatusCode::input, path + ": " + opened.fault());
    std::ifstream file(opened.path(), std::ios::binary);
    if (!file.seekg(std::streamoff(at)).read(picture.data(), std::streamsize(bytes)))
        return Status(StatusCode::input, path + ": cannot be read");
    RETURN_IF_ERROR(page->stamp.unchanged());
    return picture;
}

Result<std::shared_ptr<const PagePictures::Page>> PagePictures::indexed(
    const io::FileStamp& stamp) {
    {
        const std::lock_guard lock(mutex_);
        for (const auto& page : pages_)
            if (page->stamp == stamp) return page;
    }
    const auto page = std::make_shared<Page>(Page{stamp, {}});
    const Status status = read_lines(stamp.path, [&](const std::string& line, uint64_t at) {
        const size_t begin = line.find("\">"), end = line.rfind(kEnd);
        if (!line.starts_with(kBegin) || end == line.npos || begin > end) return;
        const size_t name = kBegin.find("image-");
        page->places[line.substr(name, begin - name)] = {at + begin + 2, end - begin - 2};
    });
    if (!status.ok()) return status;
    const std::lock_guard lock(mutex_);
    pages_.push_front(page);
    if (pages_.size() > kKeptPages) pages_.pop_back();
    return std::shared_ptr<const Page>(page);
}

}  // namespace postchain::service
