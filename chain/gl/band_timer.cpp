#include "chain/gl/band_timer.h"

#include <epoxy/gl.h>

namespace postchain::gl {

BandTimer::BandTimer(const Device& device) : software_(device.software) {
    free_.reserve(2 * kMost);
    waiting_.reserve(kMost);
}

BandTimer::~BandTimer() {
    forget();
    if (!free_.empty()) glDeleteQueries(GLsizei(free_.size()), free_.data());
}

void BandTimer::forget() {
    rates.forget();
    for (const Waiting& waiting : waiting_) {
        if (software_) break;
        free_.push_back(waiting.span.begin);
        free_.push_back(waiting.span.end);
    }
    waiting_.clear();
}

void BandTimer::abandon() {
    free_.clear();
    waiting_.clear();
}

unsigned BandTimer::stamp() {
    GLuint query = 0;
    if (free_.empty()) {
        glCreateQueries(GL_TIMESTAMP, 1, &query);
    } else {
        query = free_.back();
        free_.pop_back();
    }
    glQueryCounter(query, GL_TIMESTAMP);
    return query;
}

BandTimer::Span BandTimer::begin() {
    Span span;
    if (!software_) span.begin = stamp();
    span.begun = std::chrono::steady_clock::now();
    return span;
}

void BandTimer::end(Span& span) {
    span.wall_ms =
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - span.begun)
            .count();
    if (!software_) span.end = stamp();
}

double BandTimer::ms(const Span& span) {
    if (software_) return span.wall_ms;
    GLuint64 begin = 0, end = 0;
    glGetQueryObjectui64v(span.begin, GL_QUERY_RESULT, &begin);
    glGetQueryObjectui64v(span.end, GL_QUERY_RESULT, &end);
    free_.push_back(span.begin);
    free_.push_back(span.end);
    return end > begin ? double(end - begin) * 1e-6 : 0;
}

void BandTimer::measure(const Span& span, unsigned program, double taps, double most_rate) {
    waiting_.push_back({span, program, taps, most_rate});
}

void BandTimer::take() {
    size_t known = 0;
    for (; known < waiting_.size(); ++known) {
        const Waiting& waiting = waiting_[known];
        GLint ready = GL_TRUE;
        if (!software_) glGetQueryObjectiv(waiting.span.end, GL_QUERY_RESULT_AVAILABLE, &ready);
        if (!ready) break;
        rates.add(waiting.program, waiting.taps, ms(waiting.span), waiting.most_rate);
    }
    waiting_.erase(waiting_.begin(), waiting_.begin() + std::ptrdiff_t(known));
}

}  // namespace postchain::gl
