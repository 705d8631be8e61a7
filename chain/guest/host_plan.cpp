#include "chain/guest/host_plan.h"

#include <algorithm>
#include <string_view>

#include "chain/guest/followed_depths.h"
#include "chain/pass/work_list.h"
#include "chain/plan/hazards.h"

namespace postchain::guest {
namespace {

constexpr int kExposureUnit = 3;

std::string import_name(Neighbor neighbor) {
    return concat("import_", name_of(neighbor));
}

ProgramKey import_program(bool exposure, uint32_t arrays, bool halved) {
    constexpr uint32_t kImported = GUEST_ARRAY_COLOR | GUEST_ARRAY_DEPTH | GUEST_ARRAY_MOTION;
    return {"guest/import.comp",
            {{"EXPOSURE", flag(exposure)},
             {"ARRAYS", std::to_string(arrays & kImported)},
             {"HALF", flag(halved)}}};
}

ProgramKey mask_program(uint32_t arrays, bool halved) {
    return {"guest/import_mask.comp",
            {{"ARRAYS", std::to_string(arrays & GUEST_ARRAY_MASK)}, {"HALF", flag(halved)}}};
}

ProgramKey export_program(bool exposure) {
    return {"guest/export.comp", {{"EXPOSURE", flag(exposure)}}};
}

ProgramKey half_export_program(bool exposure, uint32_t arrays) {
    return {"guest/export_half.comp",
            {{"EXPOSURE", flag(exposure)}, {"ARRAYS", std::to_string(arrays & GUEST_ARRAY_COLOR)}}};
}

ProgramKey layer_program(bool sharpness) {
    return {"guest/layer_start.comp", {{"SHARPNESS", flag(sharpness)}}};
}

class Builder {
  public:
    Builder(Plan plan, const HostFrame& frame) : frame_(frame) { host_.plan = std::move(plan); }

    Result<HostPlan> build() {
        const char* view = frame_.given->debug_view;
        Status status;
        if (frame_.halved()) {
            add_half_output();
        } else if (frame_.shows_fill()) {
            add_fill_view();
        } else if (view && *view) {
            status = add_debug_view(view);
            if (!status.ok()) return status;
        } else {
            add_output();
        }
        add_import(frame_, host_, frame_.color_in_place(), {});
        for (const Neighbor neighbor : kNeighbors)
            if (const HostPlanes& planes = frame_.neighbors[size_t(neighbor)]; planes.given)
                add_import(planes, host_.neighbors[size_t(neighbor)], planes.color_is_plane(),
                           neighbor);
        add_mask();
        add_focus();
        const std::string& own = shared::GuestUniforms::kName;
        for (size_t i = 0; i < plan().steps.size(); ++i) {
            const Step& step = plan().steps[i];
            if (step.uniforms_type != own) continue;
            bool of_neighbor = false;
            for (const Neighbor neighbor : kNeighbors) {
                if (step.name != import_name(neighbor)) continue;
                host_.neighbor_steps[size_t(neighbor)] = int(i);
                of_neighbor = true;
            }
            if (!of_neighbor) host_.own_steps.push_back(int(i));
        }
        std::vector<TextureId> outputs;
        if (host_.result >= 0) outputs.push_back(host_.result);
        plan().outputs.clear();
        if (host_.result >= 0) plan().outputs[Role::color] = host_.result;
        find_lifetimes(plan(), outputs);
        fit(plan(), frame_.plane_width(), frame_.plane_height());
        host_.samples_arrays = frame_.all_arrays() != 0;
        for (const Step& step : plan().steps)
            for (const Binding& binding : step.bindings)
                if (binding.access == Access::sample_nearest &&
                    plan().textures[size_t(binding.texture)].slices > 0)
                    host_.samples_arrays = true;
        return std::move(host_);
    }

  private:
    Plan& plan() { return host_.plan; }

    TextureId add_texture(const std::string& name, Format format, bool imported) {
        PlanTexture texture;
        texture.name = name;
        texture.format = format;
        texture.imported = imported;
        plan().textures.push_back(texture);
        return TextureId(plan().textures.size()) - 1;
    }

    int add_pass(const char* name) {
        plan().passes.push_back({name, "", false, {}});
        return int(plan().passes.size()) - 1;
    }

    // A step over all pixels with a GuestUniforms, whose bytes are written before each run.
    Step make_step(int pass, const char* name, ProgramKey program) {
        Step step;
        step.pass = pass;
        step.name = name;
        step.program = std::move(program);
        step.set_uniforms(shared::GuestUniforms{});
        return step;
    }

    bool has_exposure() const { return frame_.exposure.name != 0; }
    void bind_exposure(Step& step) { bind_exposure(step, frame_, host_, "host."); }
    void bind_exposure(Step& step, const HostPlanes& planes, HostInputs& inputs,
                       const std::string& prefix) {
        if (planes.exposure.name == 0) return;
        if (inputs.exposure < 0) {
            inputs.exposure = add_texture(prefix + "exposure", Format::r32f, true);
            plan().textures.back().area = Area::fixed(1, 1);
        }
        step.bindings.push_back({kExposureUnit, inputs.exposure});
    }

    TextureId input(Role role) const {
        for (size_t i = 0; i < host_.plan.textures.size(); ++i)
            if (host_.plan.textures[i].imported && host_.plan.textures[i].role == role &&
                host_.plan.textures[i].name.starts_with("input."))
                return TextureId(i);
        return -1;
    }

    bool is_read(TextureId id) const {
        for (const auto& step : host_.plan.steps)
            for (const auto& binding : step.bindings)
                if (binding.texture == id && binding.access != Access::write) return true;
        return false;
    }

    // The host's texture to which the result is written, besides the chain's own.
    TextureId add_target() {
        const Format format = plan_format();
        if (frame_.output.name == 0) return add_texture("export.color", format, false);
        host_.writes_output = true;
        return add_texture("host.output", format, true);
    }
    Format plan_format() const {
        const auto found = host_.plan.outputs.find(Role::color);
        return host_.plan.textures[size_t(found->second)].format;
    }

    void add_output() {
        const TextureId color = plan().outputs.at(Role::color);
        const bool works = !plan().textures[size_t(color)].imported;
        if (!works && (frame_.output.name == 0 || frame_.output_is_color())) {
            plan().steps.clear();
            return;  // color itself
        }
        const bool as_is = frame_.top_left() && !frame_.has_gain() &&
                           (frame_.output.name == 0 || frame_.output_holds_color());
        if (as_is && frame_.output.name == 0) {
            host_.result = color;
            return;
        }
        if (works && as_is && frame_.output.at_origin && !frame_.output_is_an_input() &&
            !is_read(color)) {
            plan().textures[size_t(color)].imported =
                true;  // the last pass writes to the host's texture
            plan().textures[size_t(color)].name = "host.output";
            host_.result = color;
            host_.writes_output = true;
            return;
        }
        Step step = make_step(add_pass("export"), "export", export_program(has_exposure()));
        host_.result = add_target();
        step.bindings = {{0, color}, {0, host_.result, Access::write}};
        bind_exposure(step);
        step.taps = uint64_t(frame_.plane_width()) * uint64_t(frame_.plane_height());
        plan().steps.push_back(std::move(step));
    }

    // Makes the frame's only layer, and returns it as the chain leaves it.
    TextureId begin_layer(const char* name, const ProgramKey& program) {
        const TextureId start = input(Role::layers), layer = plan().outputs.at(Role::layers);
        plan().textures[size_t(start)].imported = false;
        Step begin = make_step(add_pass("layer"), name, program);
        begin.bindings = {{0, start, Access::write}};
        plan().steps.insert(plan().steps.begin(), std::move(begin));
        return layer;
    }

    void add_half_output() {
        const TextureId sharpness = begin_layer("sharpness_start", layer_program(true));
        Step step = make_step(add_pass("export"), "export",
                              half_export_program(has_exposure(), frame_.arrays()));
        host_.result = add_target();
        host_.color = add_texture("host.color", Format::rgba32f, true);
        step.bindings = {{0, plan().outputs.at(Role::color)},
                         {1, input(Role::color)},
                         {2, sharpness},
                         {4, host_.color},
                         {0, host_.result, Access::write}};
        bind_exposure(step);
        step.spread = Area().times(2, 2).in_squares(kBlockPx);
        step.taps = 13 * uint64_t(frame_.width) * uint64_t(frame_.height);
        plan().steps.push_back(std::move(step));
    }

    void add_fill_view() {
        const TextureId mask = begin_layer("fill_start", layer_program(false));
        host_.result = add_target();
        Step view =
            make_step(add_pass("export"), "debug_view",
                      {"guest/debug_view.comp", {{"VIEW", "5"}, {"EXPOSURE", "0"}, {"HOST", "0"}}});
        launch_by(view, -1);
        view.bindings = {{0, mask}, {0, host_.result, Access::write}};
        host_.shown = mask;
        plan().steps.push_back(std::move(view));
    }

    // The host's texture of this name, such as "host.depth", if it is given; `host` is then how the
    // view reads it.
    TextureId add_host_view(std::string_view name, std::string& host) {
        const struct {
            const char* name;
            const HostTexture& texture;
            Format format;
            TextureId HostPlan::*id;
        } views[] = {{"host.color", frame_.color, Format::rgba32f, &HostPlan::color},
                     {"host.depth", frame_.depth, Format::r32f, &HostPlan::depth},
                     {"host.motion", frame_.motion, Format::rg32f, &HostPlan::motion},
                     {"host.mask", frame_.mask, Format::r32f, &HostPlan::mask}};
        for (const auto& view : views) {
            if (name != view.name || view.texture.name == 0) continue;
            host = view.texture.array ? "2" : "1";
            return host_.*view.id = add_texture(view.name, view.format, true);
        }
        return -1;
    }

    // "0.motion_blur.tile_max" or "0.motion_blur.tile_max:vector".
    Status add_debug_view(std::string_view view) {
        const size_t colon = view.find(':');
        const std::string_view name = view.substr(0, colon);
        const std::string_view as = colon == view.npos ? "" : view.substr(colon + 1);
        std::string host = "0";
        TextureId shown = add_host_view(name, host);
        for (size_t i = 0; i < plan().textures.size(); ++i)
            if (plan().textures[i].name == name) shown = TextureId(i);
        if (shown < 0)
            return Status(StatusCode::usage,
                          concat("debug_view: this frame's plan has no texture \"", name,
                                 "\"; pc_explain() names them"));
        const PlanTexture& texture = plan().textures[size_t(shown)];
        const bool list = texture.format == Format::work_list;
        const bool bits = texture.format == Format::rgba32ui || texture.format == Format::r32ui;
        const int channels = channels_of(texture.format);
        std::string kind = list ? "3" : channels == 4 ? "0" : channels == 2 ? "2" : "1";
        if (as == "color") kind = "0";
        if (as == "number") kind = "1";
        if (as == "vector") kind = "2";
        const bool array = texture.slices > 0;
        if (bits || array ||
            (!as.empty() && (list || (as != "color" && as != "number" && as != "vector"))))
            return Status(StatusCode::usage, concat("debug_view: \"", view, "\" cannot be drawn; ",
                                                    "append :color, :number or :vector; "
                                                    "neither packed bits nor arrays "
                                                    "are drawn"));
        // Steps after the last one that writes the texture are not needed.
        int last = -1;  // of the host's own: there is none
        for (int i = 0; i < int(plan().steps.size()); ++i)
            for (const auto& binding : plan().steps[size_t(i)].bindings)
                if (binding.texture == shown && plan().steps[size_t(i)].writes(binding)) last = i;
        plan().steps.resize(size_t(last + 1));
        const int pass = add_pass("export");
        host_.result = add_target();
        const auto add = [&](const char* step_name, const std::string& how, TextureId source) {
            Step step = make_step(
                pass, step_name,
                {"guest/debug_view.comp", {{"VIEW", how}, {"EXPOSURE", "0"}, {"HOST", host}}});
            launch_by(step, how == "4" ? shown : -1);
            step.bindings.push_back({0, source});
            step.bindings.push_back({0, host_.result, Access::write});
            host_.shown = source;
            plan().steps.push_back(std::move(step));
        };
        add("debug_view", kind, list ? input(Role::color) : shown);
        if (list) add("debug_blocks", "4", input(Role::color));
        return Status();
    }

    // Planes of the frame or a neighbor that a step reads and that the host has in another form are
    // converted before the chain.
    void add_import(const HostPlanes& planes, HostInputs& inputs, bool color_in_place,
                    std::optional<Neighbor> neighbor) {
        struct Plane {
            Role role;
            int makes;
            const char* name;
            bool in_place;
            Format format;
            TextureId HostInputs::*id;
        };
        const Plane all[] = {
            {Role::color, GUEST_MAKES_COLOR, "color", color_in_place,
             planes.color_is_half() ? Format::rgba16f : Format::rgba32f, &HostInputs::color},
            {Role::inverse_depth, GUEST_MAKES_DEPTH, "depth", planes.depth_in_place(), Format::r32f,
             &HostInputs::depth},
            {Role::motion, GUEST_MAKES_MOTION, "motion", planes.motion_in_place(), Format::rg32f,
             &HostInputs::motion}};
        const std::string prefix = neighbor ? concat(name_of(*neighbor), ".") : "host.";
        Step step = make_step(0, neighbor ? import_name(*neighbor).c_str() : "import", {});
        const uint64_t pixels = uint64_t(frame_.plane_width()) * uint64_t(frame_.plane_height());
        for (int unit = 0; unit < 3; ++unit) {
            const Plane& plane = all[unit];
            const TextureId canonical =
                input(neighbor ? role_of(*neighbor, plane.role) : plane.role);
            const bool read = canonical >= 0 && is_read(canonical);
            if (!read) continue;
            if (plane.in_place) {
                inputs.*plane.id = canonical;
                continue;
            }
            inputs.makes |= plane.makes;
            plan().textures[size_t(canonical)].imported = false;
            plan().textures[size_t(canonical)].format = plane.format;
            if (inputs.*plane.id < 0)
                inputs.*plane.id = add_texture(prefix + plane.name, plane.format, true);
            const TextureId host = inputs.*plane.id;
            step.bindings.push_back({unit, host});
            step.bindings.push_back({unit, canonical, Access::write});
            step.taps += pixels;
        }
        if (inputs.makes == 0) return;
        step.program = import_program(planes.exposure.name != 0, planes.arrays(), frame_.halved());
        const bool vectors = (inputs.makes & GUEST_MAKES_MOTION) != 0;
        if (planes.sky && vectors) inputs.makes |= GUEST_MAKES_SKY;
        const bool finds = vectors && planes.motion_by_depth();
        if (finds) {
            inputs.makes |= GUEST_FINDS_MOTION;
            step.taps += 17 * pixels;
        }
        const bool chooses = finds || (frame_.halved() && vectors && planes.depth.name != 0);
        if ((inputs.makes & GUEST_MAKES_DEPTH) != 0) {
            inputs.makes |= GUEST_READS_DEPTH;
        } else if ((inputs.makes & GUEST_MAKES_SKY) != 0 || chooses) {
            inputs.makes |= GUEST_READS_DEPTH;
            if (inputs.depth < 0) inputs.depth = add_texture(prefix + "depth", Format::r32f, true);
            step.bindings.push_back({1, inputs.depth});
        }
        if ((inputs.makes & GUEST_MAKES_COLOR) != 0) bind_exposure(step, planes, inputs, prefix);
        step.pass = add_pass("import");
        plan().steps.insert(plan().steps.begin(), std::move(step));
    }

    // The host's mask, if a pass reads it, becomes the frame's only matte.
    void add_mask() {
        const TextureId mattes = input(Role::mattes);
        if (mattes < 0 || !is_read(mattes)) return;
        plan().textures[size_t(mattes)].imported = false;
        if (host_.mask < 0) host_.mask = add_texture("host.mask", Format::r32f, true);
        Step step = make_step(add_pass("import"), "import_mask",
                              mask_program(frame_.all_arrays(), frame_.halved()));
        step.bindings = {{0, host_.mask}, {0, mattes, Access::write}};
        step.taps = uint64_t(frame_.plane_width()) * uint64_t(frame_.plane_height());
        plan().steps.insert(plan().steps.begin(), std::move(step));
    }

    // The depths in focus are found beside the first steps, and not read by this frame.
    void add_focus() {
        if (frame_.focus_slot < 0) return;
        if (host_.depth < 0) host_.depth = add_texture("host.depth", Format::r32f, true);
        const TextureId found = add_texture("focus.depths", Format::work_list, true);
        plan().textures.back().area = Area::fixed(1, 1);
        Step step = focus_step(frame_, host_.depth, found);
        step.pass = add_pass("focus");
        plan().steps.insert(plan().steps.begin(), std::move(step));
    }

    const HostFrame& frame_;
    HostPlan host_;
};

}  // namespace

PlanOptions options_of(const HostFrame& frame, DeviceClass device) {
    PlanOptions options;
    options.precision = frame.flag(PC_HALF_PLANES) ? Precision::fp16 : Precision::fp32;
    options.elide = !frame.flag(PC_NO_ELISION);
    options.device = device;
    options.fast_math = frame.flag(PC_FAST_MATH);
    return options;
}

Result<HostPlan> make_host_plan(const ResolvedChain& resolved, const HostFrame& frame) {
    ASSIGN_OR_RETURN(auto plan, make_plan(resolved));
    order_by_level(plan);
    return Builder(std::move(plan), frame).build();
}

Result<HostPlan> make_host_plan(const Chain& chain, const HostFrame& frame, DeviceClass device) {
    const PlanOptions options = options_of(frame, device);
    const RuleNames rules = options.rules(chain);
    ResolvedChain resolved;
    RETURN_IF_ERROR(resolved.resolve(chain, describe(frame, chain), options, rules));
    return make_host_plan(resolved, frame);
}

shared::GuestUniforms uniforms_of(const HostFrame& frame, const HostPlan& host, const Plan& plan) {
    shared::GuestUniforms uniforms = uniforms_of(frame);
    uniforms.makes = host.makes;
    if (host.shown < 0) return uniforms;
    const PlanTexture& shown = plan.textures[size_t(host.shown)];
    uniforms.shown_size = {shown.width, shown.height};
    const struct {
        TextureId id;
        const pc_texture& texture;
        const HostTexture& checked;
    } views[] = {{host.color, frame.given->color, frame.color},
                 {host.depth, frame.given->depth, frame.depth},
                 {host.motion, frame.given->motion, frame.motion},
                 {host.mask, frame.given->mask, frame.mask}};
    for (const auto& [id, texture, checked] : views) {
        if (host.shown != id) continue;
        uniforms.shown_at = {texture.x, texture.y};
        uniforms.shown_size = {checked.width, checked.height};
        uniforms.shown_image = {checked.image.slice, checked.image.level};
    }
    return uniforms;
}

shared::GuestUniforms uniforms_of(const HostPlanes& neighbor, const HostInputs& inputs) {
    shared::GuestUniforms uniforms = uniforms_of(neighbor);
    uniforms.makes = inputs.makes;
    return uniforms;
}

std::vector<ProgramKey> host_programs(const Chain& chain, const HostFrame& given, const Plan& plan,
                                      DeviceClass device) {
    std::vector<ProgramKey> programs;
    const auto add = [&](ProgramKey key) {
        if (std::find(programs.begin(), programs.end(), key) == programs.end())
            programs.push_back(std::move(key));
    };
    const bool exposure = given.exposure.name != 0;
    add(given.halved() ? half_export_program(exposure, given.arrays()) : export_program(exposure));
    if (given.halved()) add(layer_program(true));
    // A frame may lack a plane that a pass does not need now, such as motion vectors at a cut.
    for (int lacks = 0; lacks < 32; ++lacks) {
        HostFrame frame = given;
        auto& [before, after] = frame.neighbors;
        if ((lacks & 4 && given.mask.name == 0) || (lacks & 8 && !before.given) ||
            (lacks & 16 && !after.given))
            continue;
        if (lacks & 1) frame.depth = {};
        if (lacks & 2) frame.motion = {};
        if (lacks & 4) frame.mask = {};
        if (lacks & 8) before = {};
        if (lacks & 16) after = {};
        if (frame.mask.name) add(mask_program(frame.all_arrays(), frame.halved()));
        add(import_program(exposure, frame.arrays(), frame.halved()));
        for (const HostPlanes& planes : frame.neighbors)
            if (planes.given) add(import_program(exposure, planes.arrays(), frame.halved()));
        for (ProgramKey& key :
             programs_of(chain, describe(frame, chain), options_of(frame, device)))
            add(std::move(key));
    }
    for (const Step& step : plan.steps) add(step.program);
    return programs;
}

}  // namespace postchain::guest
