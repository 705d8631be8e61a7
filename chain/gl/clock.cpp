#include "chain/gl/clock.h"

#include <epoxy/gl.h>

#include "chain/gl/context.h"

namespace postchain::gl {

Clock::Clock(const Context& context) : software_(context.software()) {}

Clock::~Clock() {
    if (!queries_.empty()) glDeleteQueries(GLsizei(queries_.size()), queries_.data());
}

void Clock::begin() {
    walls_.clear();
    used_ = 0;
    mark();
}

void Clock::mark() {
    if (software_) {
        glFinish();
        walls_.push_back(std::chrono::steady_clock::now());
        return;
    }
    if (used_ == queries_.size()) {
        GLuint query = 0;
        glCreateQueries(GL_TIMESTAMP, 1, &query);
        queries_.push_back(query);
    }
    glQueryCounter(queries_[used_++], GL_TIMESTAMP);
}

std::vector<double> Clock::read() {
    std::vector<double> milliseconds;
    if (software_) {
        for (size_t i = 1; i < walls_.size(); ++i)
            milliseconds.push_back(
                std::chrono::duration<double, std::milli>(walls_[i] - walls_[i - 1]).count());
        return milliseconds;
    }
    GLuint64 last = 0;
    for (size_t i = 0; i < used_; ++i) {
        GLuint64 now = 0;
        glGetQueryObjectui64v(queries_[i], GL_QUERY_RESULT, &now);
        if (i > 0) milliseconds.push_back(double(now - last) * 1e-6);
        last = now;
    }
    return milliseconds;
}

}  // namespace postchain::gl
