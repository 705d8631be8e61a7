#include "chain/plan/plan_print.h"

#include <cstdio>
#include <sstream>

#include "chain/base/parameter.h"
#include "chain/base/text.h"
#include "chain/plan/plan_bytes.h"

namespace postchain {
namespace {

// The bandwidth of a mid-range GPU, for which the bound of a pass is printed.
constexpr double kBytesPerMicrosecond = 4e5;

std::string megabytes(uint64_t bytes) {
    char text[32];
    std::snprintf(text, sizeof(text), "%llu.%02llu MB", (unsigned long long)(bytes / 1000000),
                  (unsigned long long)(bytes % 1000000 / 10000));
    return text;
}

// " (saves 2 dispatches, 1.84 MB, 1296 taps)", without zeros.
std::string savings(const Saving& saving) {
    std::string text;
    const auto add = [&](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
    if (saving.dispatches)
        add(concat(saving.dispatches, saving.dispatches == 1 ? " dispatch" : " dispatches"));
    if (saving.bytes)
        add(saving.bytes < 10000 ? concat(saving.bytes, " bytes") : megabytes(saving.bytes));
    if (saving.taps) add(concat(saving.taps, " taps"));
    return text.empty() ? text : " (saves " + text + ")";
}

std::string names(const Plan& plan, const Step& step, bool written) {
    std::string text;
    for (const auto& binding : step.bindings) {
        if (step.writes(binding) != written) continue;
        text += (text.empty() ? "" : ", ") + plan.textures[size_t(binding.texture)].name;
    }
    return text;
}

// "  layers 4..7", of a step that does some of the frame's.
std::string layers_of(const Step& step) {
    if (step.layers == 0) return "";
    return concat("  layers ", step.first_layer, "..", step.first_layer + step.layers - 1);
}

// "28.00", per pixel of the frame.
std::string per_pixel(double bytes) {
    char text[32];
    std::snprintf(text, sizeof(text), "%.2f", bytes);
    return text;
}

// "28.00 a pixel (12.00 read, 16.00 written)"
std::string step_bytes(const Plan& plan, const StepBytes& bytes) {
    const double pixels = double(plan.width) * plan.height;
    return concat(per_pixel(double(bytes.read + bytes.written) / pixels), " a pixel (",
                  per_pixel(double(bytes.read) / pixels), " read, ",
                  per_pixel(double(bytes.written) / pixels), " written)",
                  bytes.counts ? "" : ", not counted: another list moves more for each block");
}

// "197.15 a pixel, 408.82 MB: 1022 us at least at 400 GB/s"
std::string bound(const Plan& plan, double bytes_per_pixel) {
    const double bytes = bytes_per_pixel * plan.width * plan.height;
    return concat(per_pixel(bytes_per_pixel), " a pixel, ", megabytes(uint64_t(bytes + 0.5)), ": ",
                  uint64_t(bytes / kBytesPerMicrosecond + 0.5), " us at least at 400 GB/s");
}

}  // namespace

std::string plan_as_text(const Plan& plan) {
    const std::vector<StepBytes> bytes = bytes_of_steps(plan);
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out << "frame " << plan.frame_number << "  " << plan.width << "x" << plan.height << "  "
        << name_of(plan.precision) << "  chain " << hex_of(plan.chain_hash) << "\n";
    for (size_t i = 0; i < plan.passes.size(); ++i) {
        const auto& pass = plan.passes[i];
        out << "pass " << i << " " << pass.type << (pass.elided ? " (left out)" : "") << ": "
            << pass.text << "\n";
        for (size_t s = 0; s < plan.steps.size(); ++s) {
            const Step& step = plan.steps[s];
            if (step.pass != int(i)) continue;
            out << "  step " << step.name << "  " << step.program.text() << "  groups "
                << step.groups[0] << "x" << step.groups[1] << "x" << step.groups[2]
                << (step.work_list >= 0 ? " at most, by its list" : "") << layers_of(step) << "\n";
            if (const std::string read = names(plan, step, false); !read.empty())
                out << "    reads  " << read << "\n";
            out << "    writes " << names(plan, step, true) << "\n"
                << "    bytes  " << step_bytes(plan, bytes[s]) << "\n";
        }
        if (!pass.elided) out << "  bytes  " << bound(plan, bytes_per_pixel(plan, int(i))) << "\n";
    }
    for (const auto& elision : plan.elisions) {
        out << "left out " << item_text(elision, plan) << " [" << elision.rule
            << "]: " << text_of(elision.fact);
        out << (elision.work_list >= 0 ? concat(" (saves ", elision.taps_per_block,
                                                " taps a block; the device finds them)")
                                       : savings(elision.saving));
        out << "\n";
    }
    for (const auto& [neighbor, why] : plan.missing_neighbors)
        out << "no frame " << name_of(neighbor) << ": " << why << "\n";
    for (const auto& [place, w] : plan.inverse_depth_at)
        out << "at " << text_of(ParameterValue(place)) << " is "
            << (w > 0 ? concat(1 / w, " scene units away") : "the sky") << "\n";
    for (const auto& texture : plan.textures) {
        out << "texture " << texture.name << "  " << texture.text()
            << (texture.imported ? "  imported" : "");
        if (texture.first_step >= 0) {
            out << "  steps " << texture.first_step << "..";
            // An output outlives the last step.
            if (texture.last_step < int(plan.steps.size())) out << texture.last_step;
        }
        out << "\n";
    }
    for (const auto& [role, texture] : plan.outputs)
        out << "output " << name_of(role) << " = " << plan.textures[size_t(texture)].name << "\n";
    out << "bytes " << bound(plan, bytes_per_pixel(plan)) << "\n";
    out << "peak " << megabytes(plan.peak_bytes()) << ", transient "
        << megabytes(plan.transient_bytes()) << "\n";
    return out.str();
}

JsonObject plan_json(const Plan& plan) {
    const auto list = [](const auto& items, const auto& object_of) {
        JsonArray array;
        for (const auto& item : items) array.push_back(object_of(item));
        return array;
    };
    JsonObject json = {{"frame", plan.frame_number},
                       {"width", plan.width},
                       {"height", plan.height},
                       {"precision", name_of(plan.precision)},
                       {"chain_hash", hex_of(plan.chain_hash)},
                       {"plan_hash", hex_of(plan.hash())}};
    const auto add = [&](const char* key, JsonValue value) {
        json.push_back({key, std::move(value)});
    };
    int pass_index = 0;
    add("passes", list(plan.passes, [&](const PlanPass& pass) {
            const int index = pass_index++;
            uint64_t dispatches = 0, taps = 0;
            for (const Step& step : plan.steps)
                if (step.pass == index) {
                    ++dispatches;
                    taps += step.taps;
                }
            return JsonObject{{"pass", pass.type},
                              {"parameters", pass.text},
                              {"left_out", pass.elided},
                              {"dispatches", dispatches},
                              {"taps", taps},
                              {"bytes_per_pixel", bytes_per_pixel(plan, index)}};
        }));
    const std::vector<StepBytes> bytes = bytes_of_steps(plan);
    size_t step_index = 0;
    add("steps", list(plan.steps, [&](const Step& step) {
            JsonObject one = {{"pass", step.pass},
                              {"step", step.name},
                              {"program", step.program.text()},
                              {"groups", JsonArray(step.groups.begin(), step.groups.end())},
                              {"taps", step.taps}};
            if (step.layers > 0)
                one.insert(one.end(), {{"first_layer", step.first_layer}, {"layers", step.layers}});
            const StepBytes& moved = bytes[step_index++];
            one.insert(one.end(), {{"bytes_read", moved.read},
                                   {"bytes_written", moved.written},
                                   {"bytes_count", moved.counts}});
            one.push_back({"bindings", list(step.bindings, [&](const Binding& binding) {
                               return JsonObject{{"texture", binding.texture},
                                                 {"unit", binding.unit},
                                                 {"write", step.writes(binding)}};
                           })});
            if (step.work_list >= 0) one.push_back({"work_list", step.work_list});
            return one;
        }));
    add("textures", list(plan.textures, [](const PlanTexture& texture) {
            JsonObject one = {{"name", texture.name},
                              {"width", texture.width},
                              {"height", texture.height},
                              {"format", name_of(texture.format)}};
            if (texture.slices > 0) one.push_back({"slices", texture.slices});
            one.insert(one.end(), {{"imported", texture.imported},
                                   {"first_step", texture.first_step},
                                   {"last_step", texture.last_step}});
            return one;
        }));
    if (!plan.inverse_depth_at.empty())
        add("depth_at", list(plan.inverse_depth_at, [](const auto& entry) {
                const auto& [place, w] = entry;
                return JsonObject{{"place", ParameterValue(place)},
                                  {"distance", w > 0 ? JsonValue(1 / w) : JsonValue()}};
            }));
    add("left_out", list(plan.elisions, [&](const Elision& elision) {
            return elision_json(elision, item_text(elision, plan));
        }));
    JsonObject missing, outputs;
    for (const auto& [neighbor, why] : plan.missing_neighbors)
        missing.push_back({name_of(neighbor), why});
    if (!missing.empty()) add("missing_neighbors", std::move(missing));
    for (const auto& [role, texture] : plan.outputs)
        outputs.push_back({name_of(role), plan.textures[size_t(texture)].name});
    add("outputs", std::move(outputs));
    add("bytes_per_pixel", bytes_per_pixel(plan));
    add("peak_bytes", plan.peak_bytes());
    add("transient_bytes", plan.transient_bytes());
    return json;
}

std::string plan_as_dot(const Plan& plan) {
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out << "digraph plan {\n  rankdir=LR;\n  node [fontname=\"sans-serif\", fontsize=10];\n";
    for (size_t i = 0; i < plan.textures.size(); ++i) {
        const auto& texture = plan.textures[i];
        if (texture.first_step < 0) continue;
        out << "  t" << i << " [shape=box, label=" << quoted(texture.name + "\n" + texture.text())
            << (texture.imported ? ", style=filled, fillcolor=lightgray" : "") << "];\n";
    }
    for (size_t i = 0; i < plan.steps.size(); ++i) {
        const auto& step = plan.steps[i];
        out << "  s" << i << " [shape=ellipse, label="
            << quoted(plan.passes[size_t(step.pass)].type + "\n" + step.name) << "];\n";
        for (const auto& binding : step.bindings) {
            if (step.writes(binding))
                out << "  s" << i << " -> t" << binding.texture << ";\n";
            else
                out << "  t" << binding.texture << " -> s" << i << ";\n";
        }
    }
    for (size_t i = 0; i < plan.passes.size(); ++i)
        if (plan.passes[i].elided)
            out << "  p" << i << " [shape=ellipse, style=dashed, label="
                << quoted(plan.passes[i].type + "\nleft out") << "];\n";
    out << "}\n";
    return out.str();
}

}  // namespace postchain
