// Implementation of pc_planner: the plans of a host that executes them itself.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "chain/guest/plan_arrays.h"
#include "chain/guest/plan_cache.h"

namespace postchain::guest {

class Planner {
  public:
    static Failure create(const pc_plan_create_info& info, std::unique_ptr<Planner>& planner);
    Planner(const Planner&) = delete;
    Planner& operator=(const Planner&) = delete;

    Failure plan(const ChainVersion& chain, const pc_frame& given, pc_plan& out);
    Failure list_programs(const ChainVersion& chain, const pc_frame& given, uint64_t* keys,
                          uint32_t& count);

  private:
    using Plans = PlanCache<Planner, PlanArrays>;
    friend Plans;
    static constexpr size_t kMaxPlans = 8;

    explicit Planner(const pc_plan_create_info& info) : info_(info) {}
    Failure check(const ChainVersion& chain, const pc_frame& given, HostFrame& frame) const;
    // The host compiles its programs itself, and keeps its storage.
    static bool has(const ProgramKey&) { return true; }
    static bool holds_unused(const PlanArrays&) { return false; }
    static void retire(std::unique_ptr<PlanArrays>) {}
    Result<std::unique_ptr<PlanArrays>> compile(Plan plan, const MaxFrameSize& max_size);
    Result<uint64_t> key_of_program(const ProgramKey& key);

    const pc_plan_create_info info_;
    std::map<std::string, uint64_t> keys_;  // of programs, by ProgramKey::text()
    Plans plans_{*this, kMaxPlans, "pc_plan_programs()", find_neutral_format};
};

}  // namespace postchain::guest
