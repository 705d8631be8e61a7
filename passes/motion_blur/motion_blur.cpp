// Plans the motion blur.
//
//   motion         --tile_rows-----> half_velocity, row_max
//   row_max        --tile_max------> tile_max
//   tile_max       --neighbor_max--> neighbor_max
//   tile_max       --tile_variance-> tile_variance   only with sample_split: variance
//   frame number   --noise---------> noise           only with a jitter
//   half_velocity, neighbor_max, tile_variance, noise, color, inverse_depth
//                  --gather--------> color, hint     the hint only where a later pass reads it
//
// Tile textures are fp32 whatever the precision: they are small, and the squared length they carry
// beside v does not fit a half.
#include "passes/motion_blur/motion_blur.h"

#include "passes/motion_blur/noise.h"
#include "passes/motion_blur/parameters.h"
#include "passes/motion_blur/reference.h"
#include "shaders/shared/motion_blur_block.h"
#include "shaders/shared/motion_blur_noise_block.h"

namespace postchain::motion_blur {
namespace {

std::string flag(bool on) {
    return on ? "1" : "0";
}

class MotionBlur final : public Pass {
  public:
    RoleUse roles() const override {
        RoleUse use;
        use.required = {Role::color, Role::motion};
        if (compares_depth()) use.required.add(Role::inverse_depth);
        use.on_demand = {Role::hint};
        return use;
    }

    Status check(const FrameDescription&) const override { return Status(); }

    std::optional<LeftOut> identity(const PlanContext& context) const override {
        const FrameDescription& frame = context.frame;
        const double shutter = shutter_frames(parameters_, frame.camera);
        LeftOut left;
        if (shutter == 0) {
            left.rule = kRuleConfiguration;
            left.reason = "shutter_frames is 0";
            return left;
        }
        const double largest = 0.5 * shutter * frame.facts.max_speed_px;
        if (!(largest <= parameters_.min_speed_px)) return std::nullopt;
        left.rule = kRuleFacts;
        left.reason =
            concat("largest half-velocity ", largest, " px <= ", parameters_.min_speed_px, " px");
        return left;
    }

    void plan(PassPlanner& planner) const override {
        const PlanContext& context = planner.context();
        const VelocityStorage stored = storage(parameters_, context.precision);
        const shared::MotionBlurBlock block = make_block(context, stored);
        const int width = context.frame.width, height = context.frame.height;
        const int tiles_x = block.tiles.x, tiles_y = block.tiles.y;

        const TextureId half_velocity =
            planner.texture("half_velocity", velocity_format(stored), width, height);
        const TextureId row_max = planner.texture("row_max", Format::rgba32f, tiles_x, height);
        const TextureId tile_max = planner.texture("tile_max", Format::rgba32f, tiles_x, tiles_y);
        const TextureId neighbor_max =
            planner.texture("neighbor_max", Format::rgba32f, tiles_x, tiles_y);

        Step rows = make_step("tile_rows", {{"STORAGE", storage_define(stored)}}, block);
        rows.bindings = {{0, planner.input(Role::motion)},
                         {0, half_velocity, Access::write},
                         {1, row_max, Access::write}};
        rows.groups = groups_for(tiles_x, height);
        rows.taps = uint64_t(width) * uint64_t(height);
        planner.step(std::move(rows));

        Step columns = make_step("tile_max", {}, block);
        columns.bindings = {{0, row_max}, {0, tile_max, Access::write}};
        columns.groups = groups_for(tiles_x, tiles_y);
        columns.taps = uint64_t(tiles_x) * uint64_t(height);
        planner.step(std::move(columns));

        Step neighbors = make_step("neighbor_max", {{"SINGLE", flag(single())}}, block);
        neighbors.bindings = {{0, tile_max}, {0, neighbor_max, Access::write}};
        neighbors.groups = groups_for(tiles_x, tiles_y);
        neighbors.taps = 9 * uint64_t(tiles_x) * uint64_t(tiles_y);
        planner.step(std::move(neighbors));

        TextureId tile_variance = -1;
        if (splits_by_variance()) {
            tile_variance = planner.texture("tile_variance", Format::r32f, tiles_x, tiles_y);
            Step variance = make_step("tile_variance", {}, block);
            variance.bindings = {{0, tile_max}, {0, tile_variance, Access::write}};
            variance.groups = groups_for(tiles_x, tiles_y);
            variance.taps = 9 * uint64_t(tiles_x) * uint64_t(tiles_y);
            planner.step(std::move(variance));
        } else {
            planner.left_out("tile_variance",
                             single() ? "mode is single: one direction" : "sample_split is even");
        }

        TextureId noise = -1;
        if (jitters_tiles(parameters_) || jitters_taps(parameters_)) {
            noise = planner.texture("noise", Format::rg32f, kNoiseSize, kNoiseSize);
            planner.step(noise_step(context.frame.frame_number, noise));
        } else {
            planner.left_out("noise", "neither tiles nor taps are jittered");
        }
        gather(planner, block, stored, {half_velocity, neighbor_max, tile_variance, noise});
    }

    void reference(const PlanContext& context, ReferenceFrame& frame) const override {
        run_reference(parameters_, context, frame);
    }

    void* parameters() override { return &parameters_; }

  private:
    struct GatherInputs {
        TextureId half_velocity, neighbor_max, tile_variance, noise;  // -1 = not needed
    };

    bool single() const { return parameters_.mode == Mode::single; }
    bool compares_depth() const { return parameters_.depth_softness > 0; }
    bool splits_by_variance() const {
        return parameters_.sample_split == SampleSplit::variance && !single();
    }

    static Format velocity_format(VelocityStorage stored) {
        if (stored == VelocityStorage::fp16) return Format::rg16f;
        return stored == VelocityStorage::unorm8 ? Format::rg8 : Format::rg32f;
    }
    static std::string storage_define(VelocityStorage stored) {
        if (stored == VelocityStorage::fp16) return "1";
        return stored == VelocityStorage::unorm8 ? "2" : "0";
    }

    static Step make_step(const std::string& name, std::map<std::string, std::string> defines,
                          const shared::MotionBlurBlock& block) {
        Step step;
        step.name = name;
        step.program = {"motion_blur/" + name + ".comp", std::move(defines)};
        step.set_block(block);
        return step;
    }

    shared::MotionBlurBlock make_block(const PlanContext& context, VelocityStorage stored) const {
        const FrameDescription& frame = context.frame;
        const int edge = parameters_.max_blur_px;
        shared::MotionBlurBlock block{};
        block.size = {frame.width, frame.height};
        block.tiles = {(frame.width + edge - 1) / edge, (frame.height + edge - 1) / edge};
        block.tile_px = edge;
        block.samples = parameters_.samples;
        block.half_shutter = float(0.5 * shutter_frames(parameters_, frame.camera));
        block.still_limit_px = float(still_limit_px(parameters_, stored));
        block.jitter = float(parameters_.jitter);
        block.tile_jitter_slope = float(parameters_.tile_jitter_slope);
        block.center_total = float(parameters_.samples / parameters_.center_weight);
        block.variance_threshold_px = float(parameters_.variance_threshold_px);
        block.depth_softness = float(parameters_.depth_softness);
        return block;
    }

    Step noise_step(int frame_number, TextureId noise) const {
        shared::MotionBlurNoiseBlock block{};
        const auto shift = noise_shift(parameters_, frame_number);
        block.shift = {shift[0], shift[1]};
        if (parameters_.noise == Noise::blue) {
            const auto& ranks = blue_noise_ranks();
            for (int i = 0; i < int(ranks.size()) / 2; ++i) {
                const uint32_t pair = ranks[size_t(2 * i)] | uint32_t(ranks[size_t(2 * i + 1)])
                                                                 << 16;
                block.ranks[i / 4][i % 4] = int(pair);
            }
        }
        Step step;
        step.name = "noise";
        step.program = {"motion_blur/noise.comp",
                        {{"NOISE", std::to_string(int(parameters_.noise))}}};
        step.set_block(block);
        step.bindings = {{0, noise, Access::write}};
        step.groups = groups_for(kNoiseSize, kNoiseSize);
        return step;
    }

    void gather(PassPlanner& planner, const shared::MotionBlurBlock& block, VelocityStorage stored,
                const GatherInputs& inputs) const {
        const PlanContext& context = planner.context();
        const bool hint = planner.wanted(Role::hint);
        Step step = make_step(
            "gather",
            {{"STORAGE", storage_define(stored)},
             {"SINGLE", flag(single())},
             {"VARIANCE", flag(splits_by_variance())},
             {"TILE_JITTER", flag(jitters_tiles(parameters_))},
             {"TAP_JITTER", flag(jitters_taps(parameters_))},
             {"CLAMP", flag(parameters_.border == Border::clamp)},
             {"DOMINANT", flag(parameters_.static_direction == StaticDirection::dominant)},
             {"DEPTH", flag(compares_depth())},
             {"HINT", flag(hint)}},
            block);
        const int width = context.frame.width, height = context.frame.height;
        const TextureId color =
            planner.texture("color", plane_format(4, context.precision), width, height);
        step.bindings = {{0, planner.input(Role::color)},
                         {1, inputs.half_velocity},
                         {2, inputs.neighbor_max},
                         {0, color, Access::write}};
        if (compares_depth()) step.bindings.push_back({3, planner.input(Role::inverse_depth)});
        if (inputs.tile_variance >= 0) step.bindings.push_back({4, inputs.tile_variance});
        if (inputs.noise >= 0) step.bindings.push_back({5, inputs.noise});
        if (hint) {
            // Both gates are 0 or 1: 8 bits hold them exactly.
            const TextureId plane = planner.texture("hint", Format::rg8, width, height);
            step.bindings.push_back({1, plane, Access::write});
            planner.output(Role::hint, plane);
        } else {
            planner.left_out("hint", "no later pass reads it");
        }
        step.groups = groups_for(width, height);
        const uint64_t planes = compares_depth() ? 3 : 2;  // colour, velocity, depth
        step.taps =
            uint64_t(width) * uint64_t(height) * (planes * uint64_t(parameters_.samples + 1) + 1);
        planner.step(std::move(step));
        planner.output(Role::color, color);
    }

    Parameters parameters_;
};

}  // namespace

const PassType& pass_type() {
    static const PassType type{
        "motion_blur", "Motion blur",
        "Feature-aware motion blur from motion vectors and depth (Guertin et al., 2013).",
        &parameter_table(), [] { return std::make_unique<MotionBlur>(); }};
    return type;
}

}  // namespace postchain::motion_blur
