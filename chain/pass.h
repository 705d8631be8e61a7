// The interface of a pass, and the registry type.
//
// A pass knows its paper, its parameters, its shaders and its double-precision CPU reference. It
// does not know the order, its neighbors, files, or GL: it describes its work as steps of a plan.
// How to add one: docs/adding_a_pass.md.
#pragma once

#include <array>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "chain/elision.h"
#include "chain/frame.h"
#include "chain/origin.h"
#include "chain/parameter.h"
#include "chain/plan.h"
#include "chain/promises.h"
#include "chain/status.h"

namespace postchain {

// What a pass reads and writes, decided by its parameters alone.
struct RoleUse {
    RoleSet required;   // planes without which it cannot run (color is one of them)
    RoleSet optional;   // planes it uses when they exist
    RoleSet on_demand;  // planes it can produce, and does only if a later pass reads them
    RoleSet carried;    // planes it must rewrite when they exist and a later pass reads them
};

// All a pass may know about the frame when it plans.
struct PlanContext {
    const FrameDescription& frame;
    Precision precision = Precision::fp32;
    RoleSet available;            // planes that exist where this pass stands
    RoleSet wanted;               // planes that a later pass reads or that are outputs
    bool color_is_input = false;  // color is the frame's own: the bounds of it hold
    const RuleNames& rules;       // of leaving out, that are in use

    bool uses(std::string_view rule) const { return rules.contains(rule); }
    // Storage of color. At fp16 too it holds what the frame's own color does, or a pass left out
    // would change bits.
    Format color_format() const {
        return plane_format(4, frame.bounds.color_is_half ? precision : Precision::fp32);
    }
    // Of further layers.
    Format layers_format() const {
        return plane_format(4, frame.bounds.layers_are_half ? precision : Precision::fp32);
    }
};

// Handed to Pass::plan: adds textures and steps, names them after the pass.
class PassPlanner {
  public:
    virtual ~PassPlanner() = default;
    virtual const PlanContext& context() const = 0;

    bool has(Role role) const { return context().available.has(role); }
    bool wanted(Role role) const { return context().wanted.has(role); }
    // The plane as it is before this pass; only roles for which has() holds.
    virtual TextureId input(Role role) const = 0;
    // A new texture, "<index>.<pass>.<name>"; lives from its first to its last use.
    virtual TextureId texture(const std::string& name, Format format, int width, int height) = 0;
    // An array of such textures, one for each further layer, context().frame.layers of them; only
    // where has(Role::layers) holds.
    virtual TextureId layers(const std::string& name, Format format, int width, int height) = 0;
    virtual const PlanTexture& describe(TextureId texture) const = 0;
    // The frame's number, from which random values come. Who asks makes the plan one of this frame
    // alone (Plan::uses_frame_number); nothing else of a plan depends on the number.
    virtual int frame_number() = 0;
    // Steps run in the order they are added.
    virtual void step(Step step) = 0;
    // From here on `role` is this texture.
    virtual void output(Role role, TextureId texture) = 0;
    // Why nothing reads what the step of this name writes (rule kRuleUnusedStep). The pass adds it
    // all the same; the planner removes it and computes what that saves.
    virtual void unused(const std::string& step, Fact why) = 0;
    // Something else of the pass that is elided; its pass is filled in here.
    virtual void elide(Elision elision) = 0;
};

// A Fact in words that are literals, so that stating one allocates nothing.
struct StatedFact {
    const char* name;
    std::optional<double> value = {};
    std::optional<double> limit = {};
    const char* unit = "";
    Fact::Relation relation = Fact::Relation::at_most;

    Fact fact() const { return {name, value, limit, unit, relation}; }
};

// Why a pass returns its color bit for bit.
struct Identity {
    std::string_view rule;  // ElisionRule::name
    StatedFact fact;
};

// What decides the shape of a pass's plan besides its parameters, as numbers of its own.
using ShapeNumbers = std::array<uint64_t, 4>;

// Handed to Pass::values: puts bytes into the uniform blocks of the pass's steps.
class UniformWriter {
  public:
    virtual ~UniformWriter() = default;
    // Every step of the pass that has this type of block, or that of one name.
    template <class Uniforms>
    void set(const Uniforms& uniforms) {
        write({}, Uniforms::kName, std::as_bytes(std::span(&uniforms, 1)));
    }
    template <class Uniforms>
    void set(std::string_view step, const Uniforms& uniforms) {
        write(step, Uniforms::kName, std::as_bytes(std::span(&uniforms, 1)));
    }

  private:
    virtual void write(std::string_view step, std::string_view type,
                       std::span<const std::byte> bytes) = 0;
};

// Planes of the double-precision reference, and the named stages it passed through. A stage
// carries the name of the plan texture it must equal ("tile_max"), same size and channels.
struct ReferenceFrame {
    std::map<Role, ImageD> planes;
    std::map<std::string, ImageD> stages;
};

class Pass {
  public:
    virtual ~Pass() = default;

    virtual RoleUse roles() const = 0;
    // What holds of its results with these parameters, and on this frame.
    virtual Promises promises() const { return {}; }
    virtual Reach reach(const FrameDescription&) const { return {}; }
    // Places whose depth it has to know: frame.bounds.inverse_depth_at.
    virtual std::vector<Place> depth_places() const { return {}; }
    // Errors that need the frame (camera values, sizes). The message starts with the parameter.
    virtual Status check(const FrameDescription& frame) const = 0;
    // What it works with on this frame, for the record: lens and shutter as they are resolved, the
    // longest streak, the largest circle of confusion. Nothing of what check() refuses.
    virtual std::vector<UsedValue> used_values(const FrameDescription&) const { return {}; }
    // The pass itself knows when it returns its color bit for bit, else nothing. context.wanted is
    // an upper bound here: every plane that some later pass could read. Facts about color count
    // only where context.color_is_input.
    virtual std::optional<Identity> identity(const PlanContext& context) const = 0;
    // Describes all of the work, also for a frame on which identity() holds.
    virtual void plan(PassPlanner& planner) const = 0;
    // What plan() takes from the frame's camera, bounds and number, other than bytes of uniform
    // blocks: where these numbers are equal and the rest of the context is, it makes the same
    // textures, programs, bindings and groups. Allocates nothing.
    virtual ShapeNumbers shape(const PlanContext&) const { return {}; }
    // The blocks of plan() that follow the frame's camera, bounds and number, of another frame with
    // the same shape(): byte for byte those that plan() would give it. Allocates nothing.
    virtual void values(const PlanContext&, UniformWriter&) const {}
    // The same in double precision on the CPU, written from the paper and not from the GLSL:
    // reads frame.planes, replaces the planes it outputs, fills frame.stages. Same random values.
    virtual void reference(const PlanContext& context, ReferenceFrame& frame) const = 0;

    // The struct that PassType::parameters is the table of.
    virtual ParameterRef parameters() = 0;
    ConstParameterRef parameters() const { return const_cast<Pass*>(this)->parameters(); }
};

// A kind of pass.
struct PassType {
    std::string name;   // key in a chain file: "motion_blur"
    std::string title;  // "Motion blur"
    std::string help;   // a sentence
    const ParameterTable* parameters = nullptr;
    std::function<std::unique_ptr<Pass>()> create;  // with default parameters
    std::vector<ElisionRule> rules = {};            // its own; PlanContext::uses() asks for them
    std::vector<PassVariant> variants = {};
    std::vector<KnownLimit> known_limits = {};  // the special ones stand first
};

class PassRegistry {
  public:
    explicit PassRegistry(std::vector<PassType> types) : types_(std::move(types)) {}
    const std::vector<PassType>& types() const { return types_; }
    const PassType* find(std::string_view name) const;

  private:
    std::vector<PassType> types_;
};

// Every rule there is: the chain's own, then those of each pass.
std::vector<ElisionRule> elision_rules(const PassRegistry& registry);

}  // namespace postchain
