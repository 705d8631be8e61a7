#include "tools/service/http/report_parts.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <string_view>

#include "chain/base/readable_file.h"
#include "chain/base/stop.h"

namespace postchain::service {
namespace {

// As tools/measure/report/page/page.cpp writes them: each on a line of its own.
constexpr std::string_view kBegin = "<script type=\"text/plain\" id=\"image-";
constexpr std::string_view kEnd = "</script>";
constexpr size_t kHead = kBegin.size() + 16;  // with the id

constexpr size_t kKeptPages = 8;

struct Line {
    std::string head, tail;                 // the first kHead bytes, the last ones
    uint64_t begin = 0, end = 0, next = 0;  // end: without the line feed
};

// Calls take(line) for each line until it returns false. False: the file cannot be read.
template <class Take>
bool read_lines(const ReadableFile& opened, const Take& take) {
    std::ifstream file(opened.path(), std::ios::binary);
    std::array<char, 64 * 1024> block = {};
    Line line;
    while (file.getline(block.data(), block.size()) || file.gcount() > 0) {
        if (is_stopped()) return false;  // nobody waits for it
        const bool ends = !file.fail(), has_feed = ends && !file.eof();
        const auto got = uint64_t(file.gcount());
        const std::string_view part(block.data(), size_t(got) - (has_feed ? 1 : 0));
        line.head += part.substr(0, kHead - std::min(kHead, line.head.size()));
        line.tail += part.substr(part.size() - std::min(part.size(), kEnd.size()));
        line.tail.erase(0, line.tail.size() - std::min(line.tail.size(), kEnd.size()));
        line.end += part.size();
        line.next = line.end + (has_feed ? 1 : 0);
        if (!ends) {
            file.clear();
            continue;
        }
        if (!take(line)) return true;
        line = {.begin = line.next, .end = line.next};
    }
    return file.eof();
}

Problem none(const char* detail) {
    return {Problem::Kind::not_found, detail};
}

}  // namespace

Answer<std::vector<FilePart>> PageParts::find(const std::string& path, const std::string& id) {
    ASSIGN_OR_RETURN(const auto page, indexed(io::FileStamp::of(path)));
    if (id.empty()) return page->rest;
    const auto found = page->pictures.find(id);
    if (found == page->pictures.end()) return none("the report does not have this picture");
    return std::vector{found->second};
}

Answer<std::shared_ptr<const PageParts::Page>> PageParts::indexed(const io::FileStamp& stamp) {
    {
        const std::lock_guard lock(mutex_);
        for (const auto& page : pages_)
            if (page->stamp == stamp) return page;
    }
    const ReadableFile file(stamp.path);
    if (!file.ok()) return none("the page of the report cannot be read");
    if (file.bytes() > kMostBytes)
        return Problem{Problem::Kind::invalid, "the page of the report is larger than 4 GiB"};
    const auto page = std::make_shared<Page>(Page{stamp, {}, {}});
    const auto is_large = [](const Page& one) {
        return std::max(one.pictures.size(), one.rest.size()) > kMostPictures;
    };
    const bool read = read_lines(file, [&](const Line& line) {
        const size_t quote = line.head.find("\">"), name = kBegin.find("image-");
        if (line.head.starts_with(kBegin) && quote != std::string::npos && line.tail == kEnd) {
            page->pictures[line.head.substr(name, quote - name)] = {line.begin + quote + 2,
                                                                    line.end - kEnd.size()};
        } else if (page->rest.empty() || page->rest.back().end != line.begin) {
            page->rest.push_back({line.begin, line.next});
        } else {
            page->rest.back().end = line.next;
        }
        return !is_large(*page);
    });
    if (!read) return none("the page of the report cannot be read");
    if (is_large(*page))
        return Problem{Problem::Kind::invalid,
                       concat("the page of the report has more than ", kMostPictures, " pictures")};
    const std::lock_guard lock(mutex_);
    pages_.push_front(page);
    if (pages_.size() > kKeptPages) pages_.pop_back();
    return std::shared_ptr<const Page>(page);
}

}  // namespace postchain::service
