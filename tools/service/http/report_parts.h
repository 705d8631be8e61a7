// The page of a report in parts: its pictures are sent when they are looked at, not with the page.
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "chain/base/status.h"
#include "tools/sequence/files/file_stamp.h"

namespace postchain::service {

// The page without its pictures. Errors (input): the file cannot be read.
Result<std::string> page_without_pictures(const std::string& path);

// Pictures in pages. A page is read once to find them, and again after it has changed.
class PagePictures {
  public:
    // The text of a picture, as tools/page/viewer/picture.js decodes it. Errors (input): the file
    // cannot be read, or has no such picture.
    Result<std::string> get(const std::string& path, const std::string& id);

  private:
    struct Page {
        io::FileStamp stamp;
        std::map<std::string, std::pair<uint64_t, uint64_t>> places;  // by id: offset, bytes
    };
    Result<std::shared_ptr<const Page>> indexed(const io::FileStamp& stamp);

    std::mutex mutex_;
    std::deque<std::shared_ptr<const Page>> pages_;  // the newest first
};

}  // namespace postchain::service
