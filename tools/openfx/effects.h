// The effects of the plugin, their clips, and their description to the host. Parameters are made
// from the tables of the passes and of the camera: a row that is added there appears in the host.
//
// Identifiers of effects, clips, parameters and the order of choices are stored in documents of
// hosts.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "chain/pass/chain.h"
#include "tools/openfx/host.h"

namespace postchain::openfx {

enum class Clip { source, depth, motion, matte, behind, behind_depth, behind_motion };
inline constexpr std::array<const char*, 7> kClipNames = {
    kSourceClip, "Depth", "Motion", "Matte", "Behind", "BehindDepth", "BehindMotion"};
inline constexpr size_t kClips = kClipNames.size();
// The plane that it brings; of the three for the layer behind that layer.
Role role_of_clip(Clip clip);

struct EffectType {
    const char* identifier;
    const char* label;
    const PassType* pass;  // null: a chain, by its name or from a file
    RoleSet required;      // planes whose clips are not optional, beside color
    bool has(Clip clip) const;
    bool requires_clip(Clip clip) const;
};
const std::vector<EffectType>& effect_types();

// Names of parameters that are in no table; others are in conventions.h.
inline constexpr const char* kChain = "chain";
inline constexpr const char* kChainFile = "chain_file";
inline constexpr const char* kOverrides = "overrides";
inline constexpr const char* kFocusAt = "focus_at";
inline constexpr const char* kMatteEffect = "matte_effect";
inline constexpr const char* kCameraFile = "camera_file";
inline constexpr const char* kFrameSize = "frame_size";
inline constexpr const char* kCut = "cut";
inline constexpr const char* kCheckMotion = "check_motion";
inline constexpr const char* kCheck = "check";
inline constexpr const char* kStatus = "status";

// Rows of the camera that an effect has: those that its pass does not have itself.
std::vector<const Parameter*> camera_rows(const EffectType& type);
// The shipped chains, in the order of the choice; before them is "from chain_file".
const std::vector<std::string>& chain_names();

void describe(const EffectType& type, Effect effect);
void describe_in_context(const EffectType& type, Effect effect, bool filter);

// A region of the picture plane, y up, in the coordinates of points.
using Region = RectangleD;

// The value of a row at the time of `values`: unset if it is optional and not switched on. Points
// are places in `display`, from its top left. Error (chain): Values::choice().
Result<ParameterValue> value_of(const Values& values, const Parameter& row, const Region& display);
// Grays out the rows that have no effect with these parameters, and the values of rows that are
// unset.
void enable_rows(const Values& values, const ParameterTable& table, ConstParameterRef parameters);

}  // namespace postchain::openfx
