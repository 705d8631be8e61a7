#include "tools/service/work/helper_process.h"

#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>

namespace postchain::service {

Status HelperProcess::start(const std::string& program, const std::string& word, uint64_t memory) {
    end();
    auto in = make_pipe(), out = make_pipe();
    const auto failed = [](const Status& status) {
        return Status(StatusCode::internal, status.message());
    };
    for (const auto* pipe : {&in, &out})
        if (!pipe->ok()) return failed(pipe->status());
    ProcessSettings settings{{program, word}};
    settings.in = in->reads.get();
    settings.out = out->writes.get();
    settings.memory = memory;
    const auto child = start_process(settings);
    if (!child.ok()) return failed(child.status());
    pid_ = *child;
    to_ = std::move(in->writes);
    from_ = std::move(out->reads);
    return Status();
}

bool HelperProcess::runs() {
    if (pid_ >= 0 && ::waitpid(pid_, nullptr, WNOHANG) == pid_) pid_ = -1;
    return pid_ >= 0;
}

bool HelperProcess::send(std::string_view text) {
    for (size_t at = 0; at < text.size();) {
        const ssize_t got = ::write(to_.get(), text.data() + at, text.size() - at);
        if (got < 0 && errno == EINTR) continue;
        if (got <= 0) return false;
        at += size_t(got);
    }
    return true;
}

int HelperProcess::wait() {
    int state = 0;
    while (::waitpid(pid_, &state, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return state;
}

void HelperProcess::end() {
    to_.close();
    from_.close();
    if (pid_ >= 0) kill_process(pid_);
    pid_ = -1;
}

}  // namespace postchain::service
