// Counts how often groups of 32 invocations visit the loops and branches of a program.
//
//   shader's text --mark_visits--> the same with a mark in each loop and each branch worth one
//     as Vulkan's GLSL  a mark is a store to a buffer, which a compiler's listing shows
//     as GL's           a mark counts: once for all 32 invocations that visit it in the same rounds
//                       of all loops around it, as a GPU whose invocations run in step
//
// Storage buffer kVisitsUnit holds kMostMarks counters, as many latencies in ns that each visit
// adds to the slot of its group, kVisitSlots slots, and the set of visits.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace postchain::bench {

struct Mark {
    std::string place;  // "inverse_warp/search.glsl:214"
    enum Kind { program, loop, branch } kind;
};

inline constexpr int kVisitsUnit = 15;
// A mark of Vulkan's program stores a word at this offset of the buffer, and the next ones after
// it.
inline constexpr int kFirstMarkOffset = 1024;
inline constexpr int kMostMarks = 768;
inline constexpr int kVisitSlots = 1 << 20;
inline constexpr int kVisitSetWords = 1 << 24;
inline constexpr int64_t kVisitsBytes = 4ll * (2 * kMostMarks + kVisitSlots + kVisitSetWords);

// The counters, on the current GL context.
class VisitCounters {
  public:
    VisitCounters();
    ~VisitCounters();
    VisitCounters(const VisitCounters&) = delete;

    // Sets all to 0 and binds them. `latencies`: of each mark, ns, kMostMarks of them.
    void clear(const std::vector<uint32_t>& latencies);
    std::vector<double> counts() const;  // of each mark
    double longest_ms() const;           // the largest sum of latencies of a group of 32

  private:
    std::vector<uint32_t> read(int64_t first, int count) const;
    unsigned buffer_ = 0;
};

// Marks one file of shaders/. Numbers of new marks go on from those of `marks`, which gets them.
std::string mark_visits(const std::string& file, const std::string& text, std::vector<Mark>& marks);

// Marks all embedded shaders and writes them to `folder`.
std::vector<Mark> write_marked_shaders(const std::string& folder);

}  // namespace postchain::bench
