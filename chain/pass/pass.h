// The interface of a pass, and the registry type.
//
// A pass knows its paper, its parameters, its shaders and its double-precision CPU reference. It
// does not know the order, its neighbors, files, or GL: it describes its work as steps of a plan.
//
//   Pass            parameters                 roles(), guarantees()
//    | resolve(frame)                          errors: a camera that it cannot work with
//   PassOnFrame     parameters and one frame   identity(), plan(), write_uniforms(), reference()
//
// How to add one: docs/adding_a_pass.md.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "chain/base/parameter.h"
#include "chain/base/status.h"
#include "chain/frame/frame.h"
#include "chain/frame/origin.h"
#include "chain/pass/guarantees.h"
#include "chain/plan/device_class.h"
#include "chain/plan/elision.h"
#include "chain/plan/plan.h"

namespace postchain {

// The planes that a pass reads and writes, decided by its parameters alone.
struct RoleUse {
    RoleSet required;   // planes without which it cannot run (color is one of them)
    RoleSet optional;   // planes it uses if they exist
    RoleSet on_demand;  // planes it can produce, and does only if a later pass reads them
    RoleSet carried;    // planes it must rewrite if they exist and a later pass reads them
};

// The facts about a frame that a pass plans with.
struct PlanContext {
    const FrameDescription& frame;
    Precision precision = Precision::fp32;
    RoleSet available;            // planes available to this pass
    RoleSet wanted;               // planes that a later pass reads or that are outputs
    bool color_is_input = false;  // color is the frame's own: its bounds hold
    const RuleNames& rules;       // rules of elision in use
    DeviceClass device = DeviceClass::software;

    bool uses(std::string_view rule) const { return rules.contains(rule); }
    // All colors are one. Layers may differ, so with layers nothing is known.
    bool has_one_color() const {
        return color_is_input && frame.bounds.one_color && frame.layers == 0;
    }
    // Storage format of color. With fp16 too it holds the frame's own color, because an elided pass
    // must not change a bit.
    Format color_format() const {
        return plane_format(4, frame.bounds.color_is_half ? precision : Precision::fp32);
    }
    // Chooses the form of a program that has one for each class of device.
    void choose_form(ProgramKey& program) const {
        if (device == DeviceClass::software) program.defines["SOFTWARE_RENDERER"] = "1";
    }
    // Storage format of extra layers.
    Format layers_format() const {
        return plane_format(4, frame.bounds.layers_are_half ? precision : Precision::fp32);
    }
};

// The plan that a pass adds its textures and steps to, named after the pass.
class PassPlanner {
  public:
    // Why nothing reads what a step writes, by index of the pass and name of the step.
    using Reasons = std::map<std::pair<int, std::string>, Fact>;
    struct Target {
        Plan& plan;
        std::map<Role, TextureId>& current;  // the planes so far
        Reasons& reasons;
        int pass = 0;  // the last of plan.passes
        Status status = {};
    };
    PassPlanner(Target& target, const PlanContext& context) : target_(target), context_(context) {}
    // The same plan for a pass that sees another context: a matte's effect plans its pass so.
    PassPlanner seeing(const PlanContext& context) const { return {target_, context}; }

    const PlanContext& context() const { return context_; }
    bool has(Role role) const { return context_.available.has(role); }
    bool wanted(Role role) const { return context_.wanted.has(role); }
    // The plane as it is before this pass; -1 if there is none, never for a role that has() it.
    TextureId input(Role role) const;
    // A new texture, "<index>.<pass>.<name>"; lives from its first to its last use.
    TextureId texture(const std::string& name, Format format, const Area& area = {});
    // An array of such textures, one for each extra layer (context().frame.layers); only if
    // has(Role::layers).
    TextureId layers(const std::string& name, Format format, const Area& area = {});
    // An array of `planes` planes.
    TextureId array(const std::string& name, Format format, const Area& area, int planes);
    const PlanTexture& describe(TextureId texture) const;
    // Steps run in the order they are added. A step has work groups for every block of the frame's
    // pixels, unless its `spread` says otherwise.
    void step(Step step);
    // From here on `role` is this texture; -1: there is no such plane.
    void output(Role role, TextureId texture);
    // Why nothing reads what the step of this name writes (rule kRuleUnusedStep). The pass adds the
    // step nevertheless; the planner removes it and computes the saving.
    void unused(const std::string& step, Fact why);
    // Something else of the pass that is elided; its pass is filled in here.
    void elide(Elision elision);
    // The pass cannot be planned. The first failure counts.
    void fail(Status status);

  private:
    FrameSize frame_size() const;

    Target& target_;
    const PlanContext& context_;
};

// Layers that one dispatch filters at most, beside color: their sums are held in registers.
inline constexpr int kLayersPerStep = 4;

// Adds a step that averages color and the extra layers: the weights are color's and are found once
// for several layers. The shader's side of it is shaders/common/layers.glsl. `step` averages color.
// If the frame has extra layers the step also does the first of them, and steps for the other
// layers alone follow (they find the weights again). All of these have one program, whatever their
// number: the last one does some layers a second time. Macros: LAYERS, the number of a step's
// layers, and LAYERS_ONLY. `arrays`: bindings of layers, beside step.bindings. `taps`: fetches for
// each layer.
void add_layered_step(PassPlanner& planner, Step step, const std::vector<Binding>& arrays,
                      uint64_t taps);

// A Fact made of literals: stating one allocates nothing.
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

// A pass's decisions about its steps that follow from a frame's camera and bounds, as numbers.
using ShapeNumbers = std::array<uint64_t, 4>;

// Fills the uniform blocks that the steps of one pass declare (Step::take_uniforms()).
class UniformWriter {
  public:
    UniformWriter(Plan& plan, int pass) : plan_(plan), pass_(pass) {}
    // Every step of the pass that has this type of block, or only the step of this name.
    template <class Uniforms>
    void set(const Uniforms& uniforms) {
        write({}, Uniforms::kName, std::as_bytes(std::span(&uniforms, 1)));
    }
    template <class Uniforms>
    void set(std::string_view step, const Uniforms& uniforms) {
        write(step, Uniforms::kName, std::as_bytes(std::span(&uniforms, 1)));
    }

  private:
    void write(std::string_view step, std::string_view type, std::span<const std::byte> bytes);

    Plan& plan_;
    int pass_;
};

// Planes of the double-precision reference, and the named stages it passed through. A stage
// has the name of the plan's texture that it must equal ("tile_max"), its size and channels.
struct ReferenceFrame {
    std::map<Role, ImageD> planes;
    std::map<std::string, ImageD> stages;
};

// A pass on one frame: parameters, camera and bounds are resolved, and nothing can fail any more.
// Contexts handed in are of that frame.
class PassOnFrame {
  public:
    virtual ~PassOnFrame() = default;

    virtual Reach reach() const { return {}; }
    // The values it works with, for the record: lens and shutter as they are resolved, the longest
    // streak, the largest circle of confusion.
    virtual std::vector<UsedValue> used_values() const { return {}; }
    // Tiles, if it has textures of Area::tiles().
    virtual TileEdge tile_edge() const { return {}; }
    // The limits that this frame's bounds exceed.
    virtual std::vector<ExceededLimit> exceeded_limits() const { return {}; }
    // Why the pass returns its color bit for bit; otherwise empty. context.wanted is an upper bound
    // here: every plane that a later pass could read. Facts about color count only if
    // context.color_is_input.
    virtual std::optional<Identity> identity(const PlanContext& context) const = 0;
    // Describes all of the work, also for a frame on which identity() holds.
    virtual void plan(PassPlanner& planner) const = 0;
    // The numbers by which plan() chooses programs, textures, bindings or groups, if the frame's
    // size, camera or bounds decide them in another way than an Area does. Frames with equal
    // numbers and otherwise equal contexts have plans that differ only in uniforms and in what
    // fit() sets. Allocates nothing.
    virtual ShapeNumbers shape(const PlanContext&) const { return {}; }
    // Fills the uniform blocks of plan()'s steps, for a new plan and for one of an earlier frame of
    // the same shape(). Allocates nothing.
    virtual void write_uniforms(const PlanContext&, UniformWriter&) const {}
    // The filter in double precision on the CPU, written from the paper and not from the GLSL:
    // reads frame.planes, replaces the planes it outputs, fills frame.stages. Same random values.
    virtual void reference(const PlanContext& context, ReferenceFrame& frame) const = 0;
};

// Holds a PassOnFrame by value, in place: resolving a pass allocates nothing.
class ResolvedPass {
  public:
    template <std::derived_from<PassOnFrame> T>
    ResolvedPass(T pass) : pass_(new (bytes_) T(std::move(pass))) {
        static_assert(sizeof(T) <= kMaxBytes && alignof(T) <= alignof(std::max_align_t));
        move_ = [](PassOnFrame& from, std::byte* to) -> const PassOnFrame* {
            return new (to) T(std::move(static_cast<T&>(from)));
        };
    }
    // Refers to an object that outlives this one.
    static ResolvedPass refer_to(const PassOnFrame& pass) { return ResolvedPass(&pass); }
    ResolvedPass(ResolvedPass&& other) noexcept { take(other); }
    ResolvedPass& operator=(ResolvedPass&& other) noexcept {
        if (this != &other) {
            destroy();
            take(other);
        }
        return *this;
    }
    ~ResolvedPass() { destroy(); }

    const PassOnFrame* operator->() const { return pass_; }
    const PassOnFrame& operator*() const { return *pass_; }

  private:
    static constexpr size_t kMaxBytes = 512;
    explicit ResolvedPass(const PassOnFrame* pass) : pass_(pass) {}
    void destroy() {
        if (move_) pass_->~PassOnFrame();
    }
    void take(ResolvedPass& other) {
        move_ = other.move_;
        pass_ = move_ ? move_(const_cast<PassOnFrame&>(*other.pass_), bytes_) : other.pass_;
    }

    const PassOnFrame* pass_ = nullptr;
    const PassOnFrame* (*move_)(PassOnFrame& from, std::byte* to) = nullptr;  // null: not held
    alignas(std::max_align_t) std::byte bytes_[kMaxBytes];
};

// Plans a pass and checks that one which hands on another color hands on other layers too.
void plan_pass(const PassOnFrame& pass, PassPlanner& planner);

class Pass {
  public:
    virtual ~Pass() = default;

    virtual RoleUse roles() const = 0;
    // Guarantees about its results with these parameters.
    virtual Guarantees guarantees() const { return {}; }
    // Places whose depth it has to know: frame.bounds.inverse_depth_at.
    virtual std::vector<Place> depth_places() const { return {}; }
    // The pass on this frame, which must outlive the result. Errors: values of the camera, sizes;
    // the message starts with the parameter. Allocates nothing unless it fails.
    virtual Result<ResolvedPass> resolve(const FrameDescription& frame) const = 0;
    // The pass resolved once for every choice of programs that a frame's lens, shutter or bounds
    // can lead to; planes, layers and the shape of the aperture are those of this frame. A pass
    // without a shape() has one.
    virtual std::vector<ResolvedPass> every_shape(const FrameDescription& frame) const;

    // The struct that PassType::parameters is the table of.
    virtual ParameterRef parameters() = 0;
    ConstParameterRef parameters() const { return const_cast<Pass*>(this)->parameters(); }
};

// PassOnFrame::reach(); unbounded if the pass cannot be resolved on this frame.
Reach reach_of(const Pass& pass, const FrameDescription& frame);

// A pass that has nothing to resolve: context.frame has all that it needs.
class PlainPass : public Pass, public PassOnFrame {
  public:
    Result<ResolvedPass> resolve(const FrameDescription&) const final {
        return ResolvedPass::refer_to(*this);
    }
};

// A kind of pass.
struct PassType {
    std::string name;   // key in a chain file: "motion_blur"
    std::string title;  // "Motion blur"
    std::string help;   // a sentence
    const ParameterTable* parameters = nullptr;
    std::function<std::unique_ptr<Pass>()> create;  // with default parameters
    std::vector<ElisionRule> rules = {};            // its own; PlanContext::uses() looks them up
    std::vector<PassVariant> variants = {};
};

class PassRegistry {
  public:
    explicit PassRegistry(std::vector<PassType> types) : types_(std::move(types)) {}
    const std::vector<PassType>& types() const { return types_; }
    const PassType* find(std::string_view name) const;

  private:
    std::vector<PassType> types_;
};

// All rules: the chain's own, then those of each pass.
std::vector<ElisionRule> elision_rules(const PassRegistry& registry);

}  // namespace postchain
