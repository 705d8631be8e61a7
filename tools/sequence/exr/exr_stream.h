// Files as OpenEXR reads and writes them; what it is told of failures it says in words of its own.
#pragma once

#include <ImfIO.h>

#include <cstdint>
#include <string>
#include <vector>

#include "chain/status.h"
#include "tools/sequence/files/atomic_file.h"

namespace postchain::io {

// A file descriptor as OpenEXR wants it: buffered, every read checked.
class FdIStream final : public Imf::IStream {
  public:
    explicit FdIStream(const std::string& path) : Imf::IStream(path.c_str()) {}
    ~FdIStream() override;
    void take(int fd, uint64_t size);  // once, before the first read; the stream closes it
    int fd() const { return fd_; }
    bool read(char* to, int count) override;
    uint64_t tellg() override { return position_; }
    void seekg(uint64_t position) override { position_ = position; }

  private:
    int fd_ = -1;
    uint64_t size_ = 0;
    uint64_t position_ = 0;
    uint64_t start_ = 0;  // file position of buffer_[0]
    std::vector<char> buffer_;
};

// An AtomicFile as OpenEXR wants it. A failed write throws; `status` keeps what OpenEXR would
// wrap in words of its own.
class AtomicOStream final : public Imf::OStream {
  public:
    explicit AtomicOStream(AtomicFile& file) : Imf::OStream(file.path().c_str()), file_(file) {}
    void write(const char* from, int count) override;
    uint64_t tellp() override { return file_.position(); }
    void seekp(uint64_t position) override;

    Status status;

  private:
    AtomicFile& file_;
};

}  // namespace postchain::io
