#include "tools/apps/view/movie.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <sstream>
#include <string>
#include <vector>

extern char** environ;

namespace postchain::view {
namespace {

struct Pipe {
    int read = -1, write = -1;
    bool open() {
        std::array<int, 2> ends;
        if (pipe2(ends.data(), O_CLOEXEC) != 0) return false;
        read = ends[0];
        write = ends[1];
        return true;
    }
};

void close_end(int& end) {
    if (end >= 0) close(end);
    end = -1;
}

}  // namespace

Result<std::unique_ptr<Movie>> Movie::open(io::AtomicFile file, int width, int height, double fps) {
    const std::string path = file.path();
    std::unique_ptr<Movie> movie(new Movie(std::move(file)));
    movie->width_ = width;
    movie->height_ = height;
    Pipe in, out;
    if (!in.open() || !out.open()) return Status(StatusCode::output, path + ": no pipe to ffmpeg");
    // Sides of yuv420p are even. A file in fragments needs no seek, so it can come from a pipe.
    std::istringstream text(concat("ffmpeg -v error -f rawvideo -pixel_format rgb24 -video_size ",
                                   width, "x", height, " -framerate ", fps,
                                   " -i pipe:0 -vf pad=ceil(iw/2)*2:ceil(ih/2)*2 -pix_fmt yuv420p",
                                   " -movflags frag_keyframe+empty_moov -f mp4 pipe:1"));
    std::vector<std::string> words;
    for (std::string word; text >> word;) words.push_back(word);
    std::vector<char*> arguments;
    for (std::string& word : words) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in.read, STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, out.write, STDOUT_FILENO);
    const int error =
        posix_spawnp(&movie->process_, "ffmpeg", &actions, nullptr, arguments.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    close_end(in.read);
    close_end(out.write);
    movie->to_ = in.write;
    movie->from_ = out.read;
    if (error != 0) {
        movie->process_ = -1;
        return Status(StatusCode::output,
                      path +
                          ": the command ffmpeg cannot be started; install ffmpeg, or save the "
                          "frames");
    }
    movie->reader_ = std::thread([self = movie.get()] {
        std::array<char, 1 << 16> bytes;
        for (;;) {
            const ssize_t count = read(self->from_, bytes.data(), bytes.size());
            if (count < 0 && errno == EINTR) continue;
            if (count <= 0) return;
            if (self->written_.ok())
                self->written_ = self->file_.write(bytes.data(), size_t(count));
        }
    });
    return movie;
}

Status Movie::add(const Image<uint8_t>& frame) {
    if (frame.width != width_ || frame.height != height_)
        return Status(StatusCode::output,
                      concat(file_.path(), ": a frame of ", frame.width, "x", frame.height,
                             " pixels in a movie of ", width_, "x", height_));
    std::vector<uint8_t> bytes(3 * frame.pixels());
    for (size_t i = 0; i < bytes.size(); ++i)
        bytes[i] = frame.channels == 3 ? frame.data[i] : frame.data[i / 3];
    for (size_t at = 0; at < bytes.size();) {
        const ssize_t count = write(to_, bytes.data() + at, bytes.size() - at);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0)
            return Status(StatusCode::output,
                          file_.path() + ": ffmpeg has ended early; see its messages on stderr");
        at += size_t(count);
    }
    return Status();
}

// Whether ffmpeg ended well.
bool Movie::wait() {
    close_end(to_);
    if (reader_.joinable()) reader_.join();
    close_end(from_);
    if (process_ < 0) return false;
    int state = 0;
    while (waitpid(process_, &state, 0) < 0 && errno == EINTR) {
    }
    process_ = -1;
    return WIFEXITED(state) && WEXITSTATUS(state) == 0;
}

Status Movie::finish(io::OnExisting on_existing) {
    if (!wait())
        return Status(StatusCode::output,
                      file_.path() + ": ffmpeg has failed; see its messages on stderr");
    if (!written_.ok()) return written_;
    return file_.commit(on_existing).status();
}

Movie::~Movie() {
    wait();
}

}  // namespace postchain::view
