#include "chain/gl/clock.h"

#include <epoxy/gl.h>

#include <algorithm>

namespace postchain::gl {

Clock::Clock(const Device& device) : software_(device.software) {}

Clock::~Clock() {
    for (const Sequence& sequence : sequences_)
        if (!sequence.queries.empty())
            glDeleteQueries(GLsizei(sequence.queries.size()), sequence.queries.data());
}

void Clock::begin(uint64_t frame, uint64_t tag) {
    current_ = (current_ + 1) % kSequences;
    sequences_[current_].times.frame = frame;
    sequences_[current_].times.tag = tag;
    sequences_[current_].marks = 0;
    sequences_[current_].left_out.clear();
    take();
}

void Clock::mark(int pass, std::string_view name, std::string_view step) {
    take();
    Sequence& sequence = sequences_[current_];
    auto& intervals = sequence.times.intervals;
    if (intervals.size() < sequence.marks) intervals.resize(sequence.marks);
    Times::Interval& interval = intervals[sequence.marks - 2];
    interval.pass = pass;
    interval.name.assign(name);
    if (!step.empty()) interval.name.append(".").append(step);
}

void Clock::leave_out(double milliseconds) {
    if (milliseconds <= 0) return;
    Sequence& sequence = sequences_[current_];
    sequence.left_out.resize(sequence.marks);
    sequence.left_out.back() += milliseconds;
}

void Clock::take() {
    Sequence& sequence = sequences_[current_];
    const size_t at = sequence.marks++;
    if (software_) {
        glFinish();
        if (sequence.walls.size() <= at) sequence.walls.resize(at + 1);
        sequence.walls[at] = std::chrono::steady_clock::now();
        return;
    }
    if (at == sequence.queries.size()) {
        GLuint query = 0;
        glCreateQueries(GL_TIMESTAMP, 1, &query);
        sequence.queries.push_back(query);
    }
    glQueryCounter(sequence.queries[at], GL_TIMESTAMP);
}

bool Clock::read(Sequence& sequence) {
    if (sequence.marks == 0) return false;
    sequence.times.intervals.resize(sequence.marks - 1);
    auto& intervals = sequence.times.intervals;
    const auto set = [&](size_t i, double milliseconds) {
        const double left_out = i < sequence.left_out.size() ? sequence.left_out[i] : 0;
        intervals[i].milliseconds = milliseconds - left_out;
    };
    if (software_) {
        for (size_t i = 0; i < intervals.size(); ++i)
            set(i,
                std::chrono::duration<double, std::milli>(sequence.walls[i + 1] - sequence.walls[i])
                    .count());
        return true;
    }
    // Timestamps are taken in order: if the last is available, all are.
    GLint ready = GL_FALSE;
    glGetQueryObjectiv(sequence.queries[sequence.marks - 1], GL_QUERY_RESULT_AVAILABLE, &ready);
    if (!ready) return false;
    GLuint64 last = 0;
    for (size_t i = 0; i < sequence.marks; ++i) {
        GLuint64 now = 0;
        glGetQueryObjectui64v(sequence.queries[i], GL_QUERY_RESULT, &now);
        if (i > 0) set(i - 1, double(now - last) * 1e-6);
        last = now;
    }
    return true;
}

template <class Wanted>
const Times* Clock::newest_of(const Wanted& wanted) {
    for (size_t back = 0; back < kSequences; ++back) {
        Sequence& sequence = sequences_[(current_ + kSequences - back) % kSequences];
        if (!wanted(sequence.times.tag) || !read(sequence)) continue;
        newest_.frame = sequence.times.frame;
        newest_.tag = sequence.times.tag;
        newest_.add_up(sequence.times.intervals);
        return &newest_;
    }
    return nullptr;
}

const Times* Clock::newest() {
    return newest_of([](uint64_t) { return true; });
}

const Times* Clock::newest(std::span<const uint64_t> tags) {
    return newest_of(
        [&](uint64_t tag) { return std::find(tags.begin(), tags.end(), tag) != tags.end(); });
}

void Clock::cancel() {
    sequences_[current_].marks = 0;
}

void Clock::abandon() {
    for (Sequence& sequence : sequences_) sequence.queries.clear();
}

}  // namespace postchain::gl
