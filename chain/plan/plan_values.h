// A plan, and the bytes of its uniform blocks one behind the other, as a device takes them.
#pragma once

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include "chain/plan/plan.h"

namespace postchain {

class PlanValues {
  public:
    const Plan& plan() const { return plan_; }

    // Takes the values of a plan of the same shape.
    void take_values(Plan plan) {
        plan_ = std::move(plan);
        take_uniforms();
    }
    // Lets `write` change bytes of the plan's blocks in place, and takes them over.
    template <class Write>
    void rewrite_values(const Write& write) {
        write(plan_);
        take_uniforms();
    }
    // The uniform block of a step, as many bytes as it has.
    void set_uniforms(int step, std::span<const std::byte> bytes) {
        const Block& block = blocks_[size_t(step)];
        std::copy_n(bytes.begin(), std::min(bytes.size(), block.bytes),
                    bytes_.begin() + std::ptrdiff_t(block.offset));
    }

  protected:
    struct Block {
        size_t offset = 0, bytes = 0;
    };
    // Each block begins at a multiple of `alignment` bytes.
    PlanValues(Plan plan, size_t alignment) : plan_(std::move(plan)) {
        for (const Step& step : plan_.steps) {
            blocks_.push_back({bytes_.size(), step.uniforms.size()});
            bytes_.insert(bytes_.end(), step.uniforms.begin(), step.uniforms.end());
            bytes_.resize((bytes_.size() + alignment - 1) / alignment * alignment);
        }
    }
    const Block& block(size_t step) const { return blocks_[step]; }
    const std::vector<std::byte>& bytes() const { return bytes_; }

  private:
    void take_uniforms() {
        for (size_t i = 0; i < blocks_.size(); ++i) set_uniforms(int(i), plan_.steps[i].uniforms);
    }

    Plan plan_;
    std::vector<Block> blocks_;  // of the steps
    std::vector<std::byte> bytes_;
};

}  // namespace postchain
