// Keeps filtered images, so that a frame is filtered once.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "tools/apps/view/filter_worker.h"
#include "tools/apps/view/playback.h"

namespace postchain::view {

// A result on the screen.
struct Shown : Filtered {
    int frame = 0;
    bool draft = true;
    std::string texture_name;
    uint64_t request = 0;
    Clock::time_point since;  // of the change that it answers
};

// Two requests with equal keys have the same result.
struct ResultKey {
    int frame = 0;
    uint64_t version = 0;  // FrameStore::version()
    uint64_t chain = 0;    // Document::hash_at()
    uint64_t shaders = 0;
    auto operator<=>(const ResultKey&) const = default;
};

class ResultStore {
  public:
    explicit ResultStore(uint64_t budget) : budget_(budget) {}

    // Null: not kept.
    const Shown* find(const ResultKey& key);
    // Without its texture, in place of the results that were used longest ago, and of those of the
    // frame's former files and shaders.
    void keep(const ResultKey& key, Shown shown);
    std::vector<ResultKey> keys() const;
    uint64_t bytes() const;
    uint64_t budget() const { return budget_; }

  private:
    struct Kept {
        Shown shown;
        uint64_t bytes = 0, used = 0;
    };
    const uint64_t budget_;
    std::map<ResultKey, Kept> kept_;
    uint64_t clock_ = 0;
};

}  // namespace postchain::view
