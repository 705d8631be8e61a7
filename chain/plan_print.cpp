// A plan as text for people, JSON for programs, dot for pictures.
#include <cstdio>
#include <sstream>

#include "chain/parameter.h"
#include "chain/plan.h"
#include "chain/text.h"

namespace postchain {
namespace {

std::string megabytes(uint64_t bytes) {
    char text[32];
    std::snprintf(text, sizeof(text), "%llu.%02llu MB", (unsigned long long)(bytes / 1000000),
                  (unsigned long long)(bytes % 1000000 / 10000));
    return text;
}

// " (saves 2 dispatches, 1.84 MB, 1296 taps)", of what there is.
std::string savings(const LeftOut& left) {
    std::string text;
    const auto add = [&](const std::string& part) { text += (text.empty() ? "" : ", ") + part; };
    if (left.dispatches)
        add(concat(left.dispatches, left.dispatches == 1 ? " dispatch" : " dispatches"));
    if (left.bytes) add(left.bytes < 10000 ? concat(left.bytes, " bytes") : megabytes(left.bytes));
    if (left.taps) add(concat(left.taps, " taps"));
    return text.empty() ? text : " (saves " + text + ")";
}

std::string size_of(const PlanTexture& texture) {
    return concat(texture.width, "x", texture.height, " ", name_of(texture.format));
}

std::string names(const Plan& plan, const Step& step, bool written) {
    std::string text;
    for (const auto& binding : step.bindings) {
        if (step.writes(binding) != written) continue;
        text += (text.empty() ? "" : ", ") + plan.textures[size_t(binding.texture)].name;
    }
    return text;
}

}  // namespace

std::string plan_as_text(const Plan& plan) {
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out << "frame " << plan.frame_number << "  " << plan.width << "x" << plan.height << "  "
        << name_of(plan.precision) << "  chain " << hex_of(plan.chain_hash) << "\n";
    for (size_t i = 0; i < plan.passes.size(); ++i) {
        const auto& pass = plan.passes[i];
        out << "pass " << i << " " << pass.type << (pass.left_out ? " (left out)" : "") << ": "
            << pass.text << "\n";
        for (const auto& step : plan.steps) {
            if (step.pass != int(i)) continue;
            out << "  step " << step.name << "  " << step.program.text() << "  groups "
                << step.groups[0] << "x" << step.groups[1] << "x" << step.groups[2]
                << (step.work_list >= 0 ? " at most, by its list" : "") << "\n"
                << "    reads  " << names(plan, step, false) << "\n"
                << "    writes " << names(plan, step, true) << "\n";
        }
    }
    for (const auto& left : plan.left_out) {
        out << "left out " << left.what << " [" << left.rule << "]: " << left.reason;
        out << (left.work_list >= 0 ? concat(" (saves ", left.taps_per_block,
                                             " taps a block; the device finds them)")
                                    : savings(left));
        out << "\n";
    }
    for (const auto& texture : plan.textures) {
        out << "texture " << texture.name << "  " << size_of(texture)
            << (texture.imported ? "  imported" : "");
        if (texture.first_step >= 0)
            out << "  steps " << texture.first_step << ".." << texture.last_step;
        out << "\n";
    }
    for (const auto& [role, texture] : plan.outputs)
        out << "output " << name_of(role) << " = " << plan.textures[size_t(texture)].name << "\n";
    out << "peak " << megabytes(plan.peak_bytes()) << ", transient "
        << megabytes(plan.transient_bytes()) << "\n";
    return out.str();
}

std::string plan_as_json(const Plan& plan) {
    std::ostringstream out;
    out.imbue(std::locale::classic());
    const auto list = [&](const auto& items, auto&& print) {
        out << "[";
        bool first = true;
        for (const auto& item : items) {
            if (!first) out << ",";
            first = false;
            print(item);
        }
        out << "]";
    };
    out << "{\"frame\":" << plan.frame_number << ",\"width\":" << plan.width
        << ",\"height\":" << plan.height << ",\"precision\":" << quoted(name_of(plan.precision))
        << ",\"chain_hash\":" << quoted(hex_of(plan.chain_hash))
        << ",\"plan_hash\":" << quoted(hex_of(plan.hash())) << ",\"passes\":";
    list(plan.passes, [&](const PlanPass& pass) {
        out << "{\"pass\":" << quoted(pass.type) << ",\"parameters\":" << quoted(pass.text)
            << ",\"left_out\":" << (pass.left_out ? "true" : "false") << "}";
    });
    out << ",\"steps\":";
    list(plan.steps, [&](const Step& step) {
        out << "{\"pass\":" << step.pass << ",\"step\":" << quoted(step.name)
            << ",\"program\":" << quoted(step.program.text()) << ",\"groups\":[" << step.groups[0]
            << "," << step.groups[1] << "," << step.groups[2] << "],\"taps\":" << step.taps
            << ",\"bindings\":";
        list(step.bindings, [&](const Binding& binding) {
            out << "{\"texture\":" << binding.texture << ",\"unit\":" << binding.unit
                << ",\"write\":" << (step.writes(binding) ? "true" : "false") << "}";
        });
        if (step.work_list >= 0) out << ",\"work_list\":" << step.work_list;
        out << "}";
    });
    out << ",\"textures\":";
    list(plan.textures, [&](const PlanTexture& texture) {
        out << "{\"name\":" << quoted(texture.name) << ",\"width\":" << texture.width
            << ",\"height\":" << texture.height << ",\"format\":" << quoted(name_of(texture.format))
            << ",\"imported\":" << (texture.imported ? "true" : "false")
            << ",\"first_step\":" << texture.first_step << ",\"last_step\":" << texture.last_step
            << "}";
    });
    out << ",\"left_out\":";
    list(plan.left_out, [&](const LeftOut& left) {
        out << "{\"what\":" << quoted(left.what) << ",\"rule\":" << quoted(left.rule)
            << ",\"reason\":" << quoted(left.reason) << ",\"bytes\":" << left.bytes
            << ",\"dispatches\":" << left.dispatches << ",\"taps\":" << left.taps;
        if (left.work_list >= 0)
            out << ",\"work_list\":" << left.work_list
                << ",\"outside\":" << (left.outside ? "true" : "false")
                << ",\"taps_per_block\":" << left.taps_per_block;
        out << "}";
    });
    out << ",\"outputs\":{";
    bool first = true;
    for (const auto& [role, texture] : plan.outputs) {
        out << (first ? "" : ",") << quoted(name_of(role)) << ":"
            << quoted(plan.textures[size_t(texture)].name);
        first = false;
    }
    out << "},\"peak_bytes\":" << plan.peak_bytes()
        << ",\"transient_bytes\":" << plan.transient_bytes() << "}";
    return out.str();
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
        if (plan.passes[i].left_out)
            out << "  p" << i << " [shape=ellipse, style=dashed, label="
                << quoted(plan.passes[i].type + "\nleft out") << "];\n";
    out << "}\n";
    return out.str();
}

}  // namespace postchain
