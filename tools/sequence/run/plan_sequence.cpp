#include "tools/sequence/run/plan_sequence.h"

#include <algorithm>
#include <cstdio>

#include "chain/base/stop.h"
#include "chain/plan/plan_print.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/record/layers_json.h"
#include "tools/sequence/run/runner.h"
#include "tools/sequence/settings/run_settings.h"
#include "tools/sequence/source/frame_plan.h"
#include "tools/sequence/source/memory.h"
#include "tools/sequence/source/neighbor_planes.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::sequence {
namespace {

using io::Json;

// Program, libraries, Mesa with its compiler, compiled shaders: measured (docs/farm.md) plus a
// margin.
constexpr uint64_t kProcessBytes = uint64_t(128) << 20;

std::map<int, uint64_t> taps_by_pass(const Plan& plan) {
    std::map<int, uint64_t> taps;
    for (const Step& step : plan.steps) taps[step.pass] += step.taps;
    return taps;
}

Calibration calibration_of(const std::string& path, const Json& json) {
    Calibration calibration;
    calibration.path = path;
    const Json& plan = json.at("plan");
    calibration.pixels = plan.at("width").get<uint64_t>() * plan.at("height").get<uint64_t>();
    const Json& times = json.at("times_ms");
    calibration.read_ms = times.at("read").get<double>() + times.at("convert").get<double>();
    calibration.write_ms = times.at("write").get<double>();
    for (const Json& pass : times.at("passes"))
        calibration.passes.push_back(
            {pass.at("name").get<std::string>(), pass.at("ms").get<double>(),
             plan.at("passes").at(pass.at("pass").get<size_t>()).at("taps").get<uint64_t>()});
    return calibration;
}

// `frames`: number in the sequence or part; at most kFramesInFlight are in memory.
Memory memory_of(const FrameToRead& opened, const Plan& plan, size_t frames) {
    const auto bytes_of = [](const FrameHeader& frame) {
        return frame_bytes(frame, frame.to_read, io::Keep::all, frame.window.height());
    };
    Memory memory;
    memory.frame = bytes_of(*opened.frame);
    uint64_t neighbors = 0;
    for (const auto& [neighbor, frame] : opened.neighbors) neighbors += bytes_of(*frame);
    if (opened.behind) neighbors += behind_bytes(*opened.behind);
    for (const PlanTexture& texture : plan.textures)
        if (texture.imported) memory.textures += texture.bytes();
    memory.textures += plan.peak_bytes();
    memory.process = kProcessBytes + memory.textures + neighbors +
                     memory.frame * std::min<uint64_t>(frames, kFramesInFlight);
    memory.frame += neighbors;
    return memory;
}

Json estimate_json(const Memory& memory, const std::optional<Seconds>& seconds) {
    Json json = {
        {"memory_bytes",
         {{"frame", memory.frame}, {"textures", memory.textures}, {"process", memory.process}}}};
    if (seconds)
        json["seconds"] = {{"read", seconds->read},
                           {"filter", seconds->filter},
                           {"write", seconds->write},
                           {"all", seconds->all()}};
    return json;
}

uint64_t taps_of(const Plan& plan) {
    uint64_t taps = 0;
    for (const Step& step : plan.steps) taps += step.taps;
    return taps;
}

FrameDescription without_layers(FrameDescription description) {
    for (const Role role : {Role::layers, Role::layers_before, Role::layers_after})
        description.planes.remove(role);
    description.layers = 0;
    return description;
}

// `plan`: the frame's plan. Empty if only color is filtered. Errors: those of make_plan().
Result<std::optional<LayerCost>> layer_cost(const Chain& chain, const FramePlan& plan,
                                            const SourceFrame& frame, const PlanOptions& options) {
    const std::vector<CoverageRun> coverage = coverage_runs(chain, plan, frame, options);
    if (coverage.empty() && frame.header.layers.filtered.empty()) return std::optional<LayerCost>();
    ASSIGN_OR_RETURN(const auto alone, make_plan(chain, without_layers(plan.description), options));
    LayerCost cost;
    cost.layers = int(frame.header.layers.filtered.size());
    uint64_t taps = 0;
    const auto add = [&](const Plan& run) {
        ++cost.runs;
        cost.dispatches += run.steps.size();
        cost.peak_bytes = std::max(cost.peak_bytes, run.peak_bytes());
        taps += taps_of(run);
    };
    bool with_color = false;
    for (const CoverageRun& run : coverage) {
        with_color = with_color || run.with_color;
        cost.layers += run.layers();
        for (const CoverageSlot& slot : run.slots) cost.ids += slot.ids.size();
        ASSIGN_OR_RETURN(const auto planned,
                         make_plan(chain, described(run, frame, plan.description), options));
        add(planned);
    }
    if (!with_color) add(plan);
    for (const SeparateLayers& group : frame.separate_layers) {
        FrameDescription apart = without_layers(plan.description);
        for (const auto& [role, plane] : group.planes) apart.planes.add(role);
        apart.layers = int(group.layers.size());
        ASSIGN_OR_RETURN(const auto planned, make_plan(chain, apart, options));
        add(planned);
    }
    cost.fetches = double(taps) / double(std::max<uint64_t>(taps_of(alone), 1));
    return std::optional(cost);
}

io::Json layer_cost_json(const LayerCost& cost) {
    return {{"layers", cost.layers},
            {"ids", cost.ids},
            {"runs", cost.runs},
            {"dispatches", cost.dispatches},
            {"peak_bytes", cost.peak_bytes},
            {"fetches", cost.fetches}};
}

}  // namespace

Status plan_sequence(const Chain& chain, const RunSettings& asked, const PlanVisitor& visitor) {
    const RunSettings settings = settings_for(asked, {&chain});
    ASSIGN_OR_RETURN(auto list, io::find_frames(settings.input, settings.frames));
    SequenceReader reader(settings.source, settings.input, [&](const FrameHeader& header) {
        return planes_needed(chain, settings.source, header, settings.plan);
    });
    const auto plan_of = [&](int frame, PlanReport& planned) -> Result<Plan> {
        const auto files = list.files.find(frame);
        if (files == list.files.end()) return absent_frame(frame, settings);
        ASSIGN_OR_RETURN(const auto opened, reader.open(frame, files->second));
        ASSIGN_OR_RETURN(auto source, reader.read(opened));
        planned.warnings = source.warnings;
        planned.layers = source.header.layers;
        ASSIGN_OR_RETURN(auto plan, plan_source_frame(chain, source, settings.plan));
        for (auto& warning : plan_warnings(chain, plan, source))
            planned.warnings.push_back(std::move(warning));
        planned.resolved = resolve_values(chain, source, plan);
        ASSIGN_OR_RETURN(planned.layer_cost, layer_cost(chain, plan, source, settings.plan));
        planned.memory = memory_of(opened, plan, list.frames.size());
        return Plan(std::move(plan));
    };
    for (int frame : list.frames) {
        if (is_stopped()) return stopped_status();
        PlanReport planned{frame, Status(StatusCode::internal, "not planned"), {}, {}, {}, {}, {}};
        planned.plan = plan_of(frame, planned);
        if (!visitor(planned)) break;
    }
    return Status();
}

io::Json planned_json(const PlanReport& planned, const std::optional<Seconds>& seconds) {
    io::Json json = io::json_from(plan_json(*planned.plan));
    if (planned.resolved) json["resolved"] = resolved_json(*planned.resolved);
    if (io::Json layers = layers_json(planned.layers, {}); !layers.empty())
        json["layers"] = std::move(layers);
    if (planned.layer_cost) json["layer_cost"] = layer_cost_json(*planned.layer_cost);
    json["estimate"] = estimate_json(planned.memory, seconds);
    return json;
}

Result<Calibration> read_calibration(const std::string& path) {
    const auto text = read_text_file(path, StatusCode::input);
    if (!text.ok())
        return Status(StatusCode::input,
                      path + ": cannot be read; name the sidecar of a filtered frame");
    const auto json = io::read_json(*text, path);
    try {
        if (json.ok()) {
            Calibration calibration = calibration_of(path, *json);
            if (calibration.pixels > 0) return calibration;
        }
    } catch (const Json::exception&) {
        // Reported below for every reason.
    }
    return Status(StatusCode::input, path +
                                         ": is not the sidecar of a filtered frame; give the .json "
                                         "that `postchain run` wrote beside its output");
}

std::optional<Seconds> seconds_of(const Plan& plan, const Calibration& calibration) {
    const double pixels = double(plan.width) * double(plan.height) / double(calibration.pixels);
    Seconds seconds;
    seconds.read = calibration.read_ms * pixels / 1000;
    seconds.write = calibration.write_ms * pixels / 1000;
    std::vector<bool> used(calibration.passes.size());
    const auto taps = taps_by_pass(plan);
    for (size_t i = 0; i < plan.passes.size(); ++i) {
        if (plan.passes[i].elided) continue;
        // The calibration may have left out passes: take the next pass of the same name that ran.
        size_t at = 0;
        while (at < calibration.passes.size() &&
               (used[at] || calibration.passes[at].name != plan.passes[i].type))
            ++at;
        if (at == calibration.passes.size()) return std::nullopt;
        used[at] = true;
        const auto own = taps.find(int(i));
        const bool counted =
            own != taps.end() && own->second > 0 && calibration.passes[at].taps > 0;
        seconds.filter +=
            calibration.passes[at].ms / 1000 *
            (counted ? double(own->second) / double(calibration.passes[at].taps) : pixels);
    }
    return seconds;
}

std::string estimate_text(const Memory& memory, const std::optional<Seconds>& seconds) {
    std::string text =
        concat("memory: ", bytes_text(memory.process), " (a frame ", bytes_text(memory.frame),
               ", textures ", bytes_text(memory.textures), ")\n");
    if (!seconds) return text;
    char times[128];
    std::snprintf(times, sizeof(times), "time: %.2f s (read %.2f, filter %.2f, write %.2f)\n",
                  seconds->all(), seconds->read, seconds->filter, seconds->write);
    return text + times;
}

std::string layer_cost_text(const LayerCost& cost) {
    char fetches[32];
    std::snprintf(fetches, sizeof(fetches), "%.1f", cost.fetches);
    return concat("cost of extra layers: ", cost.layers, cost.layers == 1 ? " layer" : " layers",
                  cost.ids > 0 ? concat(" with ", cost.ids, " ids") : std::string(), ", ",
                  cost.runs, cost.runs == 1 ? " run, " : " runs, ", cost.dispatches,
                  " dispatches, ", bytes_text(cost.peak_bytes), " of textures, at most ", fetches,
                  " times the fetches of color alone\n");
}

}  // namespace postchain::sequence
