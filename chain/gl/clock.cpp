#include "chain/gl/clock.h"

#include <epoxy/gl.h>

namespace postchain::gl {

Clock::Clock(const Device& device) : software_(device.software) {}

Clock::~Clock() {
    for (const Set& set : sets_)
        if (!set.queries.empty()) glDeleteQueries(GLsizei(set.queries.size()), set.queries.data());
}

void Clock::begin() {
    walls_.clear();
    current_ = (current_ + 1) % kSets;
    sets_[current_].used = 0;
    mark();
}

void Clock::mark() {
    if (software_) {
        glFinish();
        walls_.push_back(std::chrono::steady_clock::now());
        return;
    }
    Set& set = sets_[current_];
    if (set.used == set.queries.size()) {
        GLuint query = 0;
        glCreateQueries(GL_TIMESTAMP, 1, &query);
        set.queries.push_back(query);
    }
    glQueryCounter(set.queries[set.used++], GL_TIMESTAMP);
}

std::optional<std::vector<double>> Clock::read_if_ready() const {
    std::vector<double> milliseconds;
    if (software_) {
        for (size_t i = 1; i < walls_.size(); ++i)
            milliseconds.push_back(
                std::chrono::duration<double, std::milli>(walls_[i] - walls_[i - 1]).count());
        return milliseconds;
    }
    const Set& set = sets_[current_];
    if (set.used == 0) return milliseconds;
    // Timestamps are taken in order: when the last is there, all are.
    GLint ready = GL_FALSE;
    glGetQueryObjectiv(set.queries[set.used - 1], GL_QUERY_RESULT_AVAILABLE, &ready);
    if (!ready) return std::nullopt;
    GLuint64 last = 0;
    for (size_t i = 0; i < set.used; ++i) {
        GLuint64 now = 0;
        glGetQueryObjectui64v(set.queries[i], GL_QUERY_RESULT, &now);
        if (i > 0) milliseconds.push_back(double(now - last) * 1e-6);
        last = now;
    }
    return milliseconds;
}

}  // namespace postchain::gl
