#include "tools/apps/view/state_file.h"

#include <algorithm>

#include "config/chain_file.h"
#include "tools/sequence/files/json.h"

namespace postchain::view {
namespace {

io::Json times_json(const std::deque<double>& times) {
    std::vector<double> sorted(times.begin(), times.end());
    std::sort(sorted.begin(), sorted.end());
    if (sorted.empty()) return io::Json::object();
    return {{"count", sorted.size()},
            {"median_ms", sorted[sorted.size() / 2]},
            {"p95_ms", sorted[(sorted.size() * 95 + 99) / 100 - 1]},
            {"max_ms", sorted.back()},
            {"last_ms", times.back()}};
}

}  // namespace

std::string state_json(const Session& session, const Ui& ui, const DrawnInput& input) {
    io::Json json;
    json["at_rest"] = session.at_rest() && input.settled;
    json["presses"] = input.presses;
    json["mouse"] = input.mouse;
    json["window"] = input.window;
    json["frame"] = session.frame();
    json["playing"] = session.playing();
    json["frames_played"] = session.frames_played();
    json["frames"] = session.frames();
    json["chain"] = write_chain(session.document().chain_to_save());
    json["changed"] = session.document().changed();
    json["focus_keys"] = io::Json::object();
    for (const auto& [frame, distance] : session.document().state().focus_keys)
        json["focus_keys"][std::to_string(frame)] = distance;
    json["view"] = session.view().plane;
    json["compare"] = int(session.view().compare);
    json["draft"] = session.shown().draft;
    json["filter_ms"] = session.shown().milliseconds;
    json["trouble"] = session.trouble();
    json["messages"] = io::Json::array();
    for (const Message& message : session.messages()) json["messages"].push_back(message.text);
    json["metrics"] = io::Json::object();
    for (const auto& [name, value] : session.painted().metrics)
        json["metrics"][name] = value ? io::Json(*value) : io::Json();
    json["textures_alive"] = session.shown().counters.textures_alive;
    json["texture_allocations"] = session.shown().counters.texture_allocations;
    json["export"] = {{"running", ui.exporter().state().running},
                      {"text", ui.exporter().state().text}};
    json["zoom"] = ui.port().zoom();
    json["pixel_0_0"] = ui.port().to_screen({0, 0});
    json["interface"] = times_json(ui.interface_ms());
    json["draft_latency"] = times_json(session.latencies().draft);
    json["refined_latency"] = times_json(session.latencies().refined);
    for (const auto& [name, place] : ui.context().places) json["places"][name] = place;
    return io::json_text(json, 1) + "\n";
}

}  // namespace postchain::view
