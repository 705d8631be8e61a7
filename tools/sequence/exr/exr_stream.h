// Files as streams of OpenEXR.
#pragma once

#include <ImfIO.h>

#include <cstdint>
#include <string>
#include <vector>

#include "chain/status.h"
#include "tools/sequence/files/atomic_file.h"

namespace postchain::io {

// Reads a file descriptor, buffered.
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
    uint64_t start_ = 0;  // file offset of buffer_[0]
    std::vector<char> buffer_;
};

// Writes an AtomicFile. A failed write throws; `status` keeps its error, since OpenEXR replaces the
// message.
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
