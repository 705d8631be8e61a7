#include "chain/plan_print.h"

#include <cstdio>
#include <sstream>

#include "chain/json_writer.h"
#include "chain/parameter.h"
#include "chain/plan_bytes.h"
#include "chain/text.h"

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

std::string size_of(const PlanTexture& texture) {
    return concat(texture.width, "x", texture.height,
                  texture.layers > 0 ? concat("x", texture.layers) : std::string(), " ",
                  name_of(texture.format));
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
                << (step.work_list >= 0 ? " at most, by its list" : "") << layers_of(step) << "\n"
                << "    reads  " << names(plan, step, false) << "\n"
                << "    writes " << names(plan, step, true) << "\n"
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
        out << "texture " << texture.name << "  " << size_of(texture)
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

std::string plan_as_json(const Plan& plan) {
    JsonWriter json(false);
    const auto list = [&](const char* key, const auto& items, const auto& write) {
        json.key(key).begin_array();
        for (const auto& item : items) {
            json.begin_object();
            write(item);
            json.end_object();
        }
        json.end_array();
    };
    json.begin_object();
    json.field("frame", plan.frame_number).field("width", plan.width).field("height", plan.height);
    json.field("precision", name_of(plan.precision));
    json.field("chain_hash", hex_of(plan.chain_hash)).field("plan_hash", hex_of(plan.hash()));
    int pass_index = 0;
    list("passes", plan.passes, [&](const PlanPass& pass) {
        json.field("pass", pass.type).field("parameters", pass.text);
        json.field("left_out", pass.elided);
        json.field("bytes_per_pixel", ParameterValue(bytes_per_pixel(plan, pass_index++)));
    });
    const std::vector<StepBytes> bytes = bytes_of_steps(plan);
    size_t step_index = 0;
    list("steps", plan.steps, [&](const Step& step) {
        json.field("pass", step.pass).field("step", step.name);
        json.field("program", step.program.text());
        json.key("groups").begin_array();
        for (int count : step.groups) json.value(count);
        json.end_array();
        json.field("taps", step.taps);
        if (step.layers > 0)
            json.field("first_layer", step.first_layer).field("layers", step.layers);
        const StepBytes& moved = bytes[step_index++];
        json.field("bytes_read", moved.read).field("bytes_written", moved.written);
        json.field("bytes_count", moved.counts);
        list("bindings", step.bindings, [&](const Binding& binding) {
            json.field("texture", binding.texture).field("unit", binding.unit);
            json.field("write", step.writes(binding));
        });
        if (step.work_list >= 0) json.field("work_list", step.work_list);
    });
    list("textures", plan.textures, [&](const PlanTexture& texture) {
        json.field("name", texture.name).field("width", texture.width);
        json.field("height", texture.height).field("format", name_of(texture.format));
        if (texture.layers > 0) json.field("layers", texture.layers);
        json.field("imported", texture.imported).field("first_step", texture.first_step);
        json.field("last_step", texture.last_step);
    });
    if (!plan.inverse_depth_at.empty())
        list("depth_at", plan.inverse_depth_at, [&](const auto& entry) {
            const auto& [place, w] = entry;
            json.field("place", ParameterValue(place));
            json.field("distance", w > 0 ? ParameterValue(1 / w) : ParameterValue());
        });
    list("left_out", plan.elisions,
         [&](const Elision& elision) { write_elision(json, elision, item_text(elision, plan)); });
    if (!plan.missing_neighbors.empty()) {
        json.key("missing_neighbors").begin_object();
        for (const auto& [neighbor, why] : plan.missing_neighbors)
            json.field(name_of(neighbor), why);
        json.end_object();
    }
    json.key("outputs").begin_object();
    for (const auto& [role, texture] : plan.outputs)
        json.field(name_of(role), plan.textures[size_t(texture)].name);
    json.end_object();
    json.field("bytes_per_pixel", ParameterValue(bytes_per_pixel(plan)));
    json.field("peak_bytes", plan.peak_bytes()).field("transient_bytes", plan.transient_bytes());
    json.end_object();
    return json.text();
}

std::string plan_as_dot(const Plan& plan) {
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out << "digraph plan {\n  rankdir=LR;\n  node [fontname=\"sans-serif\", fontsize=10];\n";
    for (size_t i = 0; i < plan.textures.size(); ++i) {
        const auto& texture = plan.textures[i];
        if (texture.first_step < 0) continue;
        out << "  t" << i << " [shape=box, label=" << quoted(texture.name + "\n" + size_of(texture))
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
