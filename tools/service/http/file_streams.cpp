#include "tools/service/http/file_streams.h"

#include <zlib.h>

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

class OpenFile {
  public:
    OpenFile(const ResultFile& file, std::vector<FilePart> parts)
        : name_(file.name),
          parts_(std::move(parts)),
          file_(file.path),
          in_(file_.ok() ? file_.path() : "", std::ios::binary) {}
    explicit OpenFile(const ResultFile& file) : OpenFile(file, {{0, file.bytes}}) {}

    // Empty at the end. A file that has become shorter is an error.
    Result<std::string> next() {
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
    std::vector<FilePart> parts_;  // that are left
    size_t at_ = 0;
    const ReadableFile file_;
    std::ifstream in_;
};

class FileSource final : public BodySource {
  public:
    FileSource(const ResultFile& file, const std::vector<FilePart>& parts) : file_(file, parts) {
        for (const FilePart& part : parts) bytes_ += part.end - part.begin;
    }
    uint64_t bytes() const override { return bytes_; }
    Result<std::string> next() override { return file_.next(); }

  private:
    uint64_t bytes_ = 0;
    OpenFile file_;
};

// PKWARE's APPNOTE 6.3, with the ZIP64 records throughout: outputs may be larger than 4 GiB. The
// CRC follows each file (bit 3 of the flags), because it is known when the file has been read.
class ZipSource final : public BodySource {
  public:
    explicit ZipSource(const std::vector<ResultFile>& files) : files_(files) {
        for (const ResultFile& file : files_)
            bytes_ += kLocal + kExtra16 + file.name.size() + file.bytes + kDescriptor + kCentral +
                      kExtra24 + file.name.size();
        bytes_ += kEnd;
        crcs_.resize(files_.size());
        offsets_.resize(files_.size());
    }
    uint64_t bytes() const override { return bytes_; }

    Result<std::string> next() override {
        if (at_ > files_.size()) return std::string();
        if (at_ == files_.size()) {
            ++at_;
            return directory();
        }
        std::string text;
        if (!open_) {
            open_ = std::make_unique<OpenFile>(files_[at_]);
            offsets_[at_] = sent_;
            text = local(files_[at_]);
        }
        ASSIGN_OR_RETURN(auto part, open_->next());
        crcs_[at_] = uint32_t(
            crc32_z(crcs_[at_], reinterpret_cast<const unsigned char*>(part.data()), part.size()));
        text += part;
        if (part.empty()) {
            put(text, 0x08074b50, 4);
            put(text, crcs_[at_], 4);
            put(text, files_[at_].bytes, 8);
            put(text, files_[at_].bytes, 8);
            open_.reset();
            ++at_;
        }
        sent_ += text.size();
        return text;
    }

  private:
    static constexpr uint64_t kLocal = 30, kExtra16 = 20, kDescriptor = 24, kCentral = 46,
                              kExtra24 = 28, kEnd = 56 + 20 + 22;
    static constexpr int kVersion = 45, kFlags = 0x808;  // descriptor, names in UTF-8
    static constexpr int kDate = 0x21;                   // 1980-01-01

    static void put(std::string& text, uint64_t value, int bytes) {
        for (int i = 0; i < bytes; ++i) text += char((value >> (8 * i)) & 0xff);
    }

    // Common to a file's local and central header: from the version to the lengths.
    static void put_common(std::string& text, const ResultFile& file, uint32_t crc,
                           uint64_t extra) {
        put(text, kVersion, 2);
        put(text, kFlags, 2);
        put(text, 0, 2);  // stored
        put(text, 0, 2);
        put(text, kDate, 2);
        put(text, crc, 4);
        put(text, 0xffffffff, 4);
        put(text, 0xffffffff, 4);
        put(text, file.name.size(), 2);
        put(text, extra, 2);
    }

    static std::string local(const ResultFile& file) {
        std::string text;
        put(text, 0x04034b50, 4);
        put_common(text, file, 0, kExtra16);
        text += file.name;
        put(text, 1, 2);
        put(text, 16, 2);
        put(text, file.bytes, 8);
        put(text, file.bytes, 8);
        return text;
    }

    std::string directory() const {
        std::string text;
        for (size_t i = 0; i < files_.size(); ++i) {
            put(text, 0x02014b50, 4);
            put(text, kVersion, 2);
            put_common(text, files_[i], crcs_[i], kExtra24);
            put(text, 0, 2);  // comment
            put(text, 0, 2);  // disk
            put(text, 0, 2);
            put(text, 0, 4);
            put(text, 0xffffffff, 4);
            text += files_[i].name;
            put(text, 1, 2);
            put(text, 24, 2);
            put(text, files_[i].bytes, 8);
            put(text, files_[i].bytes, 8);
            put(text, offsets_[i], 8);
        }
        const uint64_t size = text.size();
        put(text, 0x06064b50, 4);
        put(text, 44, 8);
        put(text, kVersion, 2);
        put(text, kVersion, 2);
        put(text, 0, 4);
        put(text, 0, 4);
        put(text, files_.size(), 8);
        put(text, files_.size(), 8);
        put(text, size, 8);
        put(text, sent_, 8);
        put(text, 0x07064b50, 4);
        put(text, 0, 4);
        put(text, sent_ + size, 8);
        put(text, 1, 4);
        put(text, 0x06054b50, 4);
        put(text, 0, 2);
        put(text, 0, 2);
        put(text, 0xffff, 2);
        put(text, 0xffff, 2);
        put(text, 0xffffffff, 4);
        put(text, 0xffffffff, 4);
        put(text, 0, 2);
        return text;
    }

    const std::vector<ResultFile> files_;
    uint64_t bytes_ = 0, sent_ = 0;
    std::vector<uint32_t> crcs_;
    std::vector<uint64_t> offsets_;
    size_t at_ = 0;
    std::unique_ptr<OpenFile> open_;
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

Reply zip_reply(const std::vector<ResultFile>& files, const std::string& name) {
    Reply reply;
    reply.type = "application/zip";
    reply.source = std::make_shared<ZipSource>(files);
    reply.headers.emplace_back("Content-Disposition", attachment(name));
    return reply;
}

}  // namespace postchain::service
