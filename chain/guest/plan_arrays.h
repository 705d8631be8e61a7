// A plan as the arrays of postchain_plan.h. Shape and values are those of gl::CompiledPlan: arrays
// are made once, and a frame of the same shape changes them in place.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "chain/guest/host_plan.h"
#include "chain/guest/postchain_plan.h"
#include "chain/plan/plan_values.h"
#include "chain/plan/storage.h"

namespace postchain::guest {

// Formats of a host's textures by PC_FORMAT_*; as find_format() for those of GL.
const HostFormat* find_neutral_format(unsigned format);

class PlanArrays : public PlanValues {
  public:
    // `programs`: the key of each step's program. `shape`: unique in this process.
    PlanArrays(Plan plan, const MaxFrameSize& max_size, std::vector<uint64_t> programs,
               uint64_t shape);

    void take_values(Plan plan);
    uint32_t barriers() const { return barriers_; }
    // The host's number of an imported texture.
    template <class... OfImage>
    void import(TextureId texture, uint32_t name, const OfImage&...) {
        names_[size_t(texture)] = name;
    }
    // The plan of this frame, whose textures are imported and whose values are written.
    void list(const HostPlan& host, pc_plan& out);

  private:
    void make_arrays();
    void make_barriers();
    void set_dispatches();

    const std::vector<uint64_t> programs_;
    const uint64_t shape_;
    StoragePlan shared_;
    std::vector<unsigned> names_;  // of imported textures
    std::vector<int> storage_;     // number of the storage of each texture
    uint32_t barriers_ = 0;
    int made_width_ = 0, made_height_ = 0;
    std::vector<std::string> texts_;  // what the arrays' strings are
    std::vector<pc_plan_slot> slots_;
    std::vector<pc_plan_texture> textures_;
    std::vector<pc_plan_step> steps_;
    std::vector<pc_plan_elision> elisions_;
    std::vector<pc_plan_binding> bindings_;
    std::vector<pc_plan_barrier> transitions_;
    std::vector<pc_plan_dispatch> dispatches_;
};

}  // namespace postchain::guest
