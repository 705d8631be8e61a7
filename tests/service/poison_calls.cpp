// Preloaded into a process: kills it when it opens a file whose name ends with POSTCHAIN_POISON,
// writes to no address in the thread that reads pixels of one that ends with POSTCHAIN_CRASH, as a
// decoder with a fault does, and blocks the opening of one that ends with POSTCHAIN_HANG while the
// file POSTCHAIN_HANG_WHILE exists, as a disk does that does not answer. That file grows by a byte
// each time.
#include <array>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>

#include <dlfcn.h>
#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

namespace {

void look_at(const char* path) {
    const char* poison = std::getenv("POSTCHAIN_POISON");
    if (poison && std::string_view(path).ends_with(poison)) std::raise(SIGKILL);
    const char* hang = std::getenv("POSTCHAIN_HANG");
    const char* until = std::getenv("POSTCHAIN_HANG_WHILE");
    if (!hang || !until || !std::string_view(path).ends_with(hang)) return;
    if (FILE* count = std::fopen(until, "r+")) {  // does not make it again
        std::fseek(count, 0, SEEK_END);
        std::fputc('.', count);
        std::fclose(count);
    }
    while (access(until, F_OK) == 0) usleep(10'000);
}

// Beyond the header and the table of chunks.
void look_at(int file, off_t at) {
    const char* crash = std::getenv("POSTCHAIN_CRASH");
    if (!crash || at < 4096) return;
    std::array<char, 4096> path;
    const ssize_t length =
        readlink(("/proc/self/fd/" + std::to_string(file)).c_str(), path.data(), path.size());
    if (length > 0 && std::string_view(path.data(), size_t(length)).ends_with(crash))
        *static_cast<volatile int*>(nullptr) = 0;
}

}  // namespace

// A service opens the files of its roots by openat2, which has no function of its own.
extern "C" long syscall(long number, ...) {
    using Syscall = long (*)(long, ...);
    static const auto next = reinterpret_cast<Syscall>(dlsym(RTLD_NEXT, "syscall"));
    std::array<long, 6> words;
    va_list given;
    va_start(given, number);
    for (long& word : words) word = va_arg(given, long);
    va_end(given);
    if (number == SYS_openat2) look_at(reinterpret_cast<const char*>(words[1]));
    return next(number, words[0], words[1], words[2], words[3], words[4], words[5]);
}

extern "C" int open(const char* path, int flags, ...) {
    using Open = int (*)(const char*, int, ...);
    static const auto next = reinterpret_cast<Open>(dlsym(RTLD_NEXT, "open"));
    look_at(path);
    va_list words;
    va_start(words, flags);
    const int mode = flags & O_CREAT ? va_arg(words, int) : 0;
    va_end(words);
    return next(path, flags, mode);
}

// The same on a system of 64 bits.
extern "C" int open64(const char* path, int flags, ...) __attribute__((alias("open")));

extern "C" ssize_t pread(int file, void* to, size_t bytes, off_t at) {
    using Pread = ssize_t (*)(int, void*, size_t, off_t);
    static const auto next = reinterpret_cast<Pread>(dlsym(RTLD_NEXT, "pread"));
    look_at(file, at);
    return next(file, to, bytes, at);
}

extern "C" ssize_t pread64(int file, void* to, size_t bytes, off_t at)
    __attribute__((alias("pread")));
