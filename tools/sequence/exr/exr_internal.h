// Parts of OpenEXR's C++ API that reading and writing share: files as its streams, its types,
// values of its headers as text. For sources in exr/ and frame/ only.
#pragma once

#include <ImathBox.h>
#include <ImfAttribute.h>
#include <ImfCompression.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfMultiPartInputFile.h>
#include <ImfPixelType.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "chain/base/status.h"
#include "tools/sequence/exr/exr_header_scan.h"
#include "tools/sequence/exr/exr_reader.h"
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

struct ExrFile::Impl {
    std::unique_ptr<FdIStream> stream;  // outlives `file`
    std::unique_ptr<Imf::MultiPartInputFile> file;
    HeaderFacts facts;
};

inline Window window_of(const IMATH_NAMESPACE::Box2i& box) {
    return {box.min.x, box.min.y, box.max.x, box.max.y};
}
inline IMATH_NAMESPACE::Box2i box_of(const Window& w) {
    return {{w.min_x, w.min_y}, {w.max_x, w.max_y}};
}
Imf::PixelType imf_type(PixelType type);
std::vector<ExrChannel> channels_in(const Imf::Header& header);

// Planes of one part, possibly from several PartPixels; all cover `window`.
struct PartPlanes {
    Window window;
    std::vector<const PartPixels::Plane*> planes;
};
PartPlanes planes_of(const PartPixels& pixels);

// Slices with the planes' own types and samplings; nothing is converted.
Imf::FrameBuffer frame_buffer_of(const PartPlanes& part);

// Status for the exception now being handled: out_of_memory(), otherwise `code` with `fault` before
// OpenEXR's message, and the remedy of an input behind it. Call it in catch blocks only.
Status status_of_exr_exception(StatusCode code, const std::string& place,
                               const std::string& fault = {});

const char* compression_name(Imf::Compression compression);  // "none", "zip", "dwaa", ...

// The value if its type has a short text, "(WxH preview)" for a thumbnail, otherwise "(type)".
std::string attribute_text(const Imf::Attribute& attribute);

}  // namespace postchain::io
