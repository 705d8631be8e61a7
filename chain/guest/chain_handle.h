// Implementation of pc_chain: a chain, the list of its parameters, and the cost of changing each.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "chain/guest/failure.h"
#include "chain/pass/chain.h"

namespace postchain::guest {

// The matte of a pass that treats the object of pc_frame.mask differently.
inline constexpr const char* kMask = "mask";

// The passes of the guest. chain/ knows no pass; the library of passes defines this function.
const PassRegistry& passes();

// A chain with its values at one moment. It stays as it is while the handle is changed.
struct ChainVersion {
    std::shared_ptr<const Chain> chain;
    uint64_t id = 0;                          // of its handle; unique in this process
    uint64_t revision = 0;                    // increases with every change; unique likewise
    std::weak_ptr<const uint64_t> life = {};  // expires with the handle
};

// The parameters of a chain that are numbers of samples and that their passes read, with the
// passes.
std::vector<std::pair<uint32_t, const Parameter*>> samples_of(const Chain& chain);

class ChainHandle {
  public:
    // Takes over a chain of passes(). If none of them names a matte, all
    // get kMask.
    explicit ChainHandle(Chain chain);
    // "motion_blur,fxaa". PC_ERROR_CHAIN: unknown pass; the message suggests the closest name.
    static Result<Chain> parse(std::string_view passes);

    // Later changes are made in a copy.
    ChainVersion version() const { return {chain_, *id_, revision_, id_}; }
    static uint64_t new_revision();

    // `pass`: an index, or PC_CAMERA. PC_ERROR_ARGUMENT: no such pass. PC_ERROR_CHAIN: no such key,
    // or a value outside its domain; the chain is unchanged. PC_OK with a text: a warning.
    Failure set(uint32_t pass, std::string_view key, const ParameterValue& value);
    Failure set_number(uint32_t pass, std::string_view key, double value);
    // A table of BokehKernel::kSide squared transmittances.
    Failure set_aperture(const float* values);

    // Sets a pass's effect on the object that pc_frame.mask covers.
    Failure set_mask(uint32_t pass, pc_mask_effect effect);

    // PC_ERROR_ARGUMENT: past the last row.
    Failure describe(uint32_t index, pc_parameter& row);

    std::string error;  // of the last call

  private:
    struct Row {
        uint32_t pass;
        const Parameter* parameter;
        std::vector<const char*> choices;
        std::string text;
        int cost = -1;  // unknown yet
    };
    const ParameterTable* table_of(uint32_t pass) const;
    Chain& own();  // a copy, because another thread may still read the chain
    Failure no_such_pass(uint32_t pass) const;

    std::shared_ptr<Chain> chain_;
    std::shared_ptr<const uint64_t> id_;
    uint64_t revision_ = new_revision();
    std::vector<Row> rows_;
};

// PC_COST_*: the largest change that two values of the row, from the middle of its usual range,
// make in the plan of a frame.
uint32_t cost_of(const Chain& chain, uint32_t pass, const Parameter& row);

}  // namespace postchain::guest
