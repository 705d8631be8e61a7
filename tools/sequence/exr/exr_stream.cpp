#include "tools/sequence/exr/exr_stream.h"

#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace postchain::io {
namespace {

constexpr size_t kStreamBuffer = size_t(256) << 10;

}  // namespace

void FdIStream::take(int fd, uint64_t size) {
    fd_ = fd;
    size_ = size;
}

FdIStream::~FdIStream() {
    if (fd_ >= 0) ::close(fd_);
}

bool FdIStream::read(char* to, int count) {
    // OpenEXR 3.1 passes on the stored size of a copied tile without checking its sign.
    if (count < 0) throw std::runtime_error("a chunk of negative size");
    size_t left = size_t(count);
    while (left > 0) {
        if (position_ >= start_ && position_ < start_ + buffer_.size()) {
            const size_t offset = size_t(position_ - start_);
            const size_t n = std::min(left, buffer_.size() - offset);
            std::memcpy(to, buffer_.data() + offset, n);
            to += n;
            left -= n;
            position_ += n;
            continue;
        }
        const bool direct = left >= kStreamBuffer;
        if (!direct) buffer_.resize(kStreamBuffer);
        ssize_t n;
        do {
            n = ::pread(fd_, direct ? to : buffer_.data(), direct ? left : buffer_.size(),
                        off_t(position_));
        } while (n < 0 && errno == EINTR);
        if (n <= 0) {
            buffer_.clear();
            throw std::runtime_error(n < 0 ? std::strerror(errno) : "the file ends too early");
        }
        if (direct) {
            to += n;
            left -= size_t(n);
            position_ += uint64_t(n);
        } else {
            buffer_.resize(size_t(n));
            start_ = position_;
        }
    }
    return position_ < size_;
}

void AtomicOStream::write(const char* from, int count) {
    if (Status s = file_.write(from, size_t(count)); !s.ok()) {
        status = s;
        throw std::runtime_error(s.message());
    }
}

void AtomicOStream::seekp(uint64_t position) {
    if (Status s = file_.seek(position); !s.ok()) {
        status = s;
        throw std::runtime_error(s.message());
    }
}

}  // namespace postchain::io
