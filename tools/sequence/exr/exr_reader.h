// Reading EXR.
//
//   path --scan_header (checks sizes before OpenEXR allocates)--> OpenEXR --open--> ExrFile
//   ExrFile --read_part--> PartPixels (native planes, one pass over the part) --> ImageF
//
// Parts without compression, ZIP and ZIPS are unpacked here (exr_chunks.h), deep parts are
// flattened (deep_reader.h), and the others are unpacked by OpenEXR; threads for both:
// set_exr_threads().
#pragma once

#include <memory>
#include <string>

#include "tools/sequence/exr/pixel_file.h"

namespace postchain::io {

// Sets the number of threads that pack and unpack pixels, for every reader and writer of the
// process: those of OpenEXR's pool, and those of WorkerPool with the caller's. 0 = the caller's
// only.
void set_exr_threads(int count);

class ExrFile final : public PixelFile {
  public:
    // Errors (input), each with the path: missing, a folder, unreadable, zero bytes, not an EXR,
    // truncated, contradictory header, above `limits`.
    static Result<ExrFile> open(const std::string& path, const ReadLimits& limits = {});
    ExrFile(ExrFile&&) noexcept;
    ExrFile& operator=(ExrFile&&) noexcept;
    ~ExrFile() override;

    int rows_at_once(int part) const override;

    struct Impl;  // tools/sequence/exr/exr_internal.h
    Impl& impl() { return *impl_; }

  private:
    ExrFile();
    Status read_planes(PartPixels& pixels) override;

    std::unique_ptr<Impl> impl_;
};

}  // namespace postchain::io
