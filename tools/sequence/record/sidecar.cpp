#include "tools/sequence/record/sidecar.h"

#include "chain/base/readable_file.h"
#include "chain/plan/plan_print.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/record/layers_json.h"

namespace postchain::sequence {
namespace {

using io::Json;

Json times_json(const FrameReport& report) {
    Json passes = Json::array();
    for (const auto& time : report.pass_times)
        passes.push_back({{"pass", time.pass}, {"name", time.name}, {"ms", time.milliseconds}});
    return {{"read", report.findings.read_ms},
            {"convert", report.findings.convert_ms},
            {"filter", report.filter_ms},
            {"write", report.write_ms},
            {"passes", passes},
            {"passes_source", report.timing_source},
            // Reading, filtering and writing of neighboring frames share the machine.
            {"overlapped", true}};
}

// plan_json() without steps and textures, which are most of it: `postchain plan --json` prints
// them.
Json brief_plan(const Plan& plan) {
    Json json = io::json_from(plan_json(plan));
    for (const char* key : {"steps", "textures"}) json.erase(key);
    return json;
}

// Values that fit on a line are on one; longer objects and lists have a line for each value.
std::string folded(const Json& json, const std::string& indent = "") {
    constexpr size_t kLine = 120;
    const std::string text = io::json_text(json);
    if (!json.is_structured() || indent.size() + text.size() <= kLine) return text;
    const std::string inner = indent + " ";
    std::string lines;
    for (const auto& [key, value] : json.items())
        lines += concat(lines.empty() ? "" : ",", "\n", inner,
                        json.is_object() ? io::json_text(key) + ": " : "", folded(value, inner));
    return concat(json.is_object() ? "{" : "[", lines, "\n", indent, json.is_object() ? "}" : "]");
}

Json summary_json(const FrameReport& report) {
    Json inputs = Json::object();
    for (const auto& [role, path] : report.inputs) inputs[name_of(role)] = path;
    Json json = {{"frame", report.frame},
                 {"outcome", name_of(report.outcome)},
                 {"inputs", inputs},
                 {"output", report.output}};
    if (report.outcome == Outcome::held) json["held_from"] = report.held_from;
    if (!report.status.ok()) {
        json["error"] = report.status.message();
        json["error_code"] = name_of(report.status.code());
    }
    if (!report.warnings.empty()) json["warnings"] = report.warnings;
    return json;
}

}  // namespace

void add_findings(Json& json, const FrameBounds& bounds, const FrameFindings& findings) {
    const InputHealth& health = findings.health;
    json["bounds"] = {{"max_speed_px", bounds.max_speed_px},
                      {"max_speed_back_px", bounds.max_speed_back_px},
                      {"min_inverse_depth", bounds.min_inverse_depth},
                      {"max_inverse_depth", bounds.max_inverse_depth},
                      {"min_color", bounds.min_color},
                      {"max_color", bounds.max_color},
                      {"one_color", bounds.one_color},
                      {"color_is_half", bounds.color_is_half},
                      {"camera_cut", bounds.camera_cut}};
    json["health"] = {{"input_nonfinite_color", health.nonfinite_color},
                      {"input_nonfinite_depth", health.nonfinite_depth},
                      {"input_nonfinite_motion", health.nonfinite_motion},
                      {"input_sentinel_motion", health.sentinel_motion},
                      {"input_negative_depth", health.negative_depth},
                      {"input_motion_all_zero", health.motion_all_zero}};
    json["health"]["input_mixed_edge_depth"] = findings.edges.parts().depth;
    json["health"]["input_mixed_edge_motion"] = findings.edges.parts().motion;
    json["health"]["input_clear_edges"] = findings.clear_edges;
    json["health"]["input_sky_without_motion"] = findings.sky.without_motion();
    json["health"]["sky_motion_from_camera"] = findings.sky_motion_from_camera;
    json["health"]["motion_from_camera"] = findings.motion_from_camera;
    json["health"]["zoom_motion_added"] = findings.zoom_motion_added;
    if (health.first_nonfinite) json["health"]["input_first_nonfinite"] = *health.first_nonfinite;
}

std::string sidecar_json(const FrameReport& report, const FrameLayers& layers,
                         const std::string& version) {
    Json json = summary_json(report);
    json["output_bytes"] = report.write.bytes;
    json["work"] = report.provenance;
    json["profile"] = report.profile;
    if (!report.views.empty()) json["views"] = report.views;
    if (report.resolved) json["resolved"] = resolved_json(*report.resolved);
    if (io::Json found = layers_json(layers, report.cryptomattes); !found.empty())
        json["layers"] = std::move(found);
    const FramePlan& plan = *report.plan;  // every written frame has one
    json["plan"] = brief_plan(plan);
    for (const auto& elision : plan.elisions)
        if (const auto found = found_in(elision, plan, report.work_done);
            found && found->kind == ElisionKind::blocks)
            json["left_out_on_device"].push_back(
                io::json_from(elision_json(*found, item_text(*found, plan))));
    for (const auto& done : report.work_done)
        json["blocks"].push_back({{"list", done.list}, {"blocks", done.blocks}, {"of", done.of}});
    json["times_ms"] = times_json(report);
    add_findings(json, plan.description.bounds, report.findings);
    json["health"]["output_nonfinite"] = report.output_nonfinite;
    json["health"]["output_half_overflow"] = report.write.overflow_pixels;
    json["counters"] = {{"texture_allocations", report.counters.texture_allocations},
                        {"textures_alive", report.counters.textures_alive},
                        {"texture_bytes_peak", report.counters.texture_bytes_peak},
                        {"programs", report.counters.programs},
                        {"dispatches", report.counters.dispatches},
                        {"frames_in_flight", report.frames_in_flight}};
    if (!report.write.notes.empty()) json["write_notes"] = report.write.notes;
    json["renderer"] = report.renderer;
    json["version"] = version;
    return folded(json) + "\n";
}

std::string sidecar_path(const std::string& output) {
    return output + ".json";
}

bool is_sidecar(const std::string& path) {
    const auto json = io::read_json(text_of_file(path), path);
    if (!json.ok() || !json->is_object()) return false;
    const auto work = json->find("work");
    return work != json->end() && work->is_string() &&
           work->get_ref<const std::string&>().starts_with("postchain ");
}

io::Json report_json(const FrameReport& report, const RunProgress& progress) {
    Json json = summary_json(report);
    json["done"] = progress.done;
    json["total"] = progress.total;
    json["elapsed_s"] = progress.elapsed_s;
    json["remaining_s"] = progress.remaining_s;
    json["bytes"] = report.written_bytes;
    json["times_ms"] = times_json(report);
    return json;
}

}  // namespace postchain::sequence
