// An MP4 by the command ffmpeg: frames go to its standard input, the file comes from its output.
#pragma once

#include <sys/types.h>

#include <memory>
#include <thread>

#include "chain/base/image.h"
#include "tools/sequence/files/atomic_file.h"

namespace postchain::view {

class Movie {
  public:
    // Errors (output): ffmpeg is not installed.
    static Result<std::unique_ptr<Movie>> open(io::AtomicFile file, int width, int height,
                                               double fps);
    ~Movie();  // without finish(): writes nothing
    Movie(const Movie&) = delete;
    Movie& operator=(const Movie&) = delete;

    // Three channels, or one. Errors (output): another size, ffmpeg has ended.
    Status add(const Image<uint8_t>& frame);
    // Errors (output): ffmpeg failed; those of AtomicFile::commit().
    Status finish(io::OnExisting on_existing);

  private:
    explicit Movie(io::AtomicFile file) : file_(std::move(file)) {}
    bool wait();

    io::AtomicFile file_;
    int width_ = 0, height_ = 0;
    pid_t process_ = -1;
    int to_ = -1, from_ = -1;
    Status written_;
    std::thread reader_;
};

}  // namespace postchain::view
