#include "tools/sequence/run/estimate.h"

#include <algorithm>
#include <cstdio>
#include <fstream>

#include "tools/sequence/run/runner.h"
#include "tools/sequence/source/behind_planes.h"
#include "tools/sequence/source/memory.h"

namespace postchain::sequence {
namespace {

using io::Json;

// Program, libraries, Mesa with its compiler, compiled shaders: measured (docs/scale.md) plus a
// margin.
constexpr uint64_t kProcessBytes = uint64_t(128) << 20;

std::map<int, uint64_t> taps_of(const Plan& plan) {
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
    std::map<int, uint64_t> taps;
    for (const Json& step : plan.at("steps"))
        taps[step.at("pass").get<int>()] += step.at("taps").get<uint64_t>();
    for (const Json& pass : times.at("passes"))
        calibration.passes.push_back({pass.at("name").get<std::string>(),
                                      pass.at("ms").get<double>(),
                                      taps[pass.at("pass").get<int>()]});
    return calibration;
}

}  // namespace

Memory memory_of(const FrameInputs& inputs, const Plan& plan, size_t frames) {
    const auto bytes_of = [](const OpenedFrame& frame) {
        return frame_bytes(frame.header, frame.planes, io::Keep::all, frame.header.window.height());
    };
    Memory memory;
    memory.frame = bytes_of(*inputs.frame);
    uint64_t neighbors = 0;
    for (const auto& [neighbor, frame] : inputs.neighbors) neighbors += bytes_of(*frame);
    if (inputs.behind) neighbors += behind_bytes(*inputs.behind);
    for (const PlanTexture& texture : plan.textures)
        if (texture.imported) memory.textures += texture.bytes();
    memory.textures += plan.peak_bytes();
    memory.process = kProcessBytes + memory.textures + neighbors +
                     memory.frame * std::min<uint64_t>(frames, kFramesInFlight);
    memory.frame += neighbors;
    return memory;
}

Result<Calibration> read_calibration(const std::string& path) {
    std::ifstream file(path);
    if (!file) return Status(StatusCode::input, path + ": cannot be read");
    try {
        const Json json = Json::parse(file);
        Calibration calibration = calibration_of(path, json);
        if (calibration.pixels > 0) return calibration;
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
    const auto taps = taps_of(plan);
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

}  // namespace postchain::sequence
