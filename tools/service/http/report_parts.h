// The page of a report in parts: its pictures are sent when they are looked at, not with the page.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "tools/sequence/files/file_stamp.h"
#include "tools/service/http/message.h"

namespace postchain::service {

// Finds the pictures of pages. A page is read once for that, and again after it has changed. Its
// user may have made it: the memory does not depend on its lines.
class PageParts {
  public:
    // Where the text of a picture is, as tools/page/viewer/picture.js decodes it, or, without an
    // id, the page without its pictures.
    Answer<std::vector<FilePart>> find(const std::string& path, const std::string& id = "");

    static constexpr uint64_t kMostBytes = uint64_t(4) << 30;
    static constexpr size_t kMostPictures = 100'000;

  private:
    struct Page {
        io::FileStamp stamp;
        std::map<std::string, FilePart> pictures;  // by id
        std::vector<FilePart> rest;
    };
    Answer<std::shared_ptr<const Page>> indexed(const io::FileStamp& stamp);

    std::mutex mutex_;
    std::deque<std::shared_ptr<const Page>> pages_;  // the newest first
};

}  // namespace postchain::service
