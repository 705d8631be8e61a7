#include "tools/service/http/file_streams.h"

#include <fstream>

#include "chain/base/readable_file.h"

namespace postchain::service {
namespace {

constexpr size_t kPart = 256 * 1024;

std::string attachment(const std::string& name) {
    std::string plain;
    for (const char c : name) plain += c >= 0x20 && c < 0x7f && c != '"' && c != '\\' ? c : '_';
    return "attachment; filename=\"" + plain + "\"";
}

// Reads the parts one after another. A file that has become shorter is an error.
class FileSource final : public BodySource {
  public:
    FileSource(const ResultFile& file, const std::vector<FilePart>& parts)
        : name_(file.name),
          parts_(parts),
          file_(file.path),
          in_(file_.ok() ? file_.path() : "", std::ios::binary) {
        for (const FilePart& part : parts) bytes_ += part.end - part.begin;
    }
    uint64_t bytes() const override { return bytes_; }
    Result<std::string> next() override {
        while (at_ < parts_.size() && parts_[at_].begin == parts_[at_].end) ++at_;
        if (at_ == parts_.size()) return std::string();
        FilePart& left = parts_[at_];
        std::string read(size_t(std::min<uint64_t>(left.end - left.begin, kPart)), '\0');
        in_.seekg(std::streamoff(left.begin)).read(read.data(), std::streamsize(read.size()));
        if (uint64_t(in_.gcount()) != read.size())
            return Status(StatusCode::input, name_ + ": was changed while it was sent");
        left.begin += read.size();
        return read;
    }

  private:
    const std::string name_;
    uint64_t bytes_ = 0;
    std::vector<FilePart> parts_;  // that are left
    size_t at_ = 0;
    const ReadableFile file_;
    std::ifstream in_;
};

}  // namespace

Reply parts_reply(const ResultFile& file, const std::vector<FilePart>& parts) {
    Reply reply;
    reply.type = file.type;
    reply.source = std::make_shared<FileSource>(file, parts);
    return reply;
}

Reply file_reply(const ResultFile& file) {
    return parts_reply(file, {{0, file.bytes}});
}

Reply download_reply(const ResultFile& file) {
    Reply reply = file_reply(file);
    reply.headers.emplace_back("Content-Disposition", attachment(file.name));
    return reply;
}

}  // namespace postchain::service
