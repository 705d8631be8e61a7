// postchain plan: what would run on each frame, what is left out and why.
#include "tools/apps/postchain/subcommands.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <optional>
#include <sstream>

#include "chain/base/printable.h"
#include "chain/base/text.h"
#include "chain/plan/plan_bytes.h"
#include "chain/plan/plan_print.h"
#include "tools/apps/common/checks.h"
#include "tools/apps/common/log.h"
#include "tools/sequence/record/layers_json.h"
#include "tools/sequence/run/device.h"
#include "tools/sequence/run/plan_sequence.h"
#include "tools/sequence/source/sequence_survey.h"

namespace postchain {
namespace {

struct PlanSettings {
    std::string format = "text";
    std::string calibration;  // path of a sidecar, empty = none
    int most = 0;             // frames; 0 = all
};

using Calibration = std::optional<sequence::Calibration>;

// None if the calibration does not tell.
std::optional<sequence::Seconds> seconds_of(const sequence::PlanReport& planned,
                                            const Calibration& calibration) {
    if (!calibration) return std::nullopt;
    const auto seconds = sequence::seconds_of(*planned.plan, *calibration);
    if (!seconds)
        log::warning(concat("--calibration ", calibration->path, ": frame ", planned.frame,
                            " runs a pass that the calibration did not; cannot estimate its time"));
    return seconds;
}

std::string verbose_text(const sequence::PlanReport& planned,
                         std::optional<sequence::Seconds> seconds) {
    std::string text = plan_as_text(*planned.plan) + sequence::resolved_text(*planned.resolved) +
                       sequence::layers_text(planned.layers);
    if (planned.layer_cost) text += sequence::layer_cost_text(*planned.layer_cost);
    return text + sequence::estimate_text(planned.memory, seconds);
}

// " samples=9 hint=threshold": non-default values as in a chain file.
std::string changed_values(const ChainLink& link) {
    const auto twin = link.type->create();
    std::string text;
    for (const auto& row : link.type->parameters->rows()) {
        const ParameterValue value = row.get(link.pass->parameters());
        if (value != row.get(twin->parameters())) text += " " + row.key + "=" + text_of(value);
    }
    return text.empty() ? " default values" : text;
}

bool found_by_device(const Elision& elision) {
    return elision.work_list >= 0;
}

// Without the pass, which is printed above: "tile_variance, hint".
std::string item_of(const Elision& elision) {
    return elision.kind == ElisionKind::plane && elision.pass >= 0 ? "reading " + elision.item
                                                                   : elision.item;
}

// One line for each rule and reason, with the items that share them.
void add_left_out(std::ostringstream& out, const Plan& plan, int pass, const char* words) {
    std::vector<const Elision*> own;
    for (const auto& elision : plan.elisions)
        if (elision.pass == pass) own.push_back(&elision);
    std::vector<bool> said(own.size());
    for (size_t i = 0; i < own.size(); ++i) {
        if (said[i]) continue;
        std::vector<std::string> items;
        for (size_t k = i; k < own.size(); ++k) {
            if (own[k]->rule != own[i]->rule || own[k]->fact != own[i]->fact ||
                found_by_device(*own[k]) != found_by_device(*own[i]))
                continue;
            said[k] = true;
            if (!own[k]->item.empty()) items.push_back(item_of(*own[k]));
        }
        out << words << " " << (items.empty() ? "whole" : joined(items)) << ": "
            << text_of(own[i]->fact) << " [" << own[i]->rule << "]"
            << (found_by_device(*own[i]) ? ", if the device finds it" : "") << "\n";
    }
}

// One line for each file or other origin of lens and shutter values: "camera file camera.json:
// focal_length_mm 50 mm, f_stop 1.4". plan -v also shows the file's line.
void add_resolved(std::ostringstream& out, const sequence::PassValues& pass) {
    std::vector<std::pair<std::string, std::vector<std::string>>> places;
    for (const auto& one : pass.values) {
        std::string place = one.origin.from;
        if (!one.origin.where.empty()) {
            std::string where = one.origin.where;
            const size_t colon = where.find_last_not_of("0123456789");
            if (colon != std::string::npos && where[colon] == ':') where.resize(colon);
            place += " " + where;
        }
        const bool none = std::holds_alternative<std::monostate>(one.value);
        std::string value = none ? std::string("none") : text_of(one.value);
        if (const double* number = std::get_if<double>(&one.value)) {
            char text[32];
            std::snprintf(text, sizeof(text), "%.4g", *number);
            value = text;
        }
        const std::string words = concat(one.key, " ", value, one.unit.empty() || none ? "" : " ",
                                         none ? std::string() : one.unit);
        auto found = std::find_if(places.begin(), places.end(),
                                  [&](const auto& known) { return known.first == place; });
        if (found == places.end()) found = places.insert(places.end(), {place, {}});
        found->second.push_back(words);
    }
    for (const auto& [place, words] : places)
        out << "    " << printable(place) << ": " << joined(words) << "\n";
}

std::string cost_of(const Plan& plan, int pass) {
    const auto steps = std::count_if(plan.steps.begin(), plan.steps.end(),
                                     [&](const Step& step) { return step.pass == pass; });
    char bytes[48];
    std::snprintf(bytes, sizeof(bytes), "%.1f bytes a pixel", bytes_per_pixel(plan, pass));
    return concat(steps, steps == 1 ? " dispatch, " : " dispatches, ", bytes);
}

// Summary of a planned frame: the passes with their non-default parameters, what is left out of
// each with rule and reason, and the cost. (plan_as_text() shows dispatches and textures.) The
// first line has the frame's number and size. `seconds`: as from seconds_of().
std::string plan_summary(const Chain& chain, const sequence::PlanReport& planned,
                         const std::optional<sequence::Seconds>& seconds) {
    const Plan& plan = *planned.plan;
    std::ostringstream out;
    out.imbue(std::locale::classic());
    out << "frame " << plan.frame_number << "  " << plan.width << "x" << plan.height << "  "
        << name_of(plan.precision) << "  chain " << hex_of(plan.chain_hash) << "\n";
    for (size_t i = 0; i < plan.passes.size(); ++i) {
        const PlanPass& pass = plan.passes[i];
        out << "  " << i << " " << pass.type << ":" << printable(changed_values(chain.links[i]))
            << " (" << (pass.elided ? std::string("does not run") : cost_of(plan, int(i))) << ")\n";
        if (planned.resolved && i < planned.resolved->passes.size())
            add_resolved(out, planned.resolved->passes[i]);
        add_left_out(out, plan, int(i), "    left out");
    }
    add_left_out(out, plan, -1, "  left out of the input");
    for (const auto& [neighbor, why] : plan.missing_neighbors)
        out << "  no frame " << name_of(neighbor) << ": " << printable(why) << "\n";
    for (const auto& [place, w] : plan.inverse_depth_at)
        out << "  at " << text_of(ParameterValue(place)) << " is "
            << (w > 0 ? concat(1 / w, " scene units away") : "the sky") << "\n";
    char bytes[48];
    std::snprintf(bytes, sizeof(bytes), "%.1f", bytes_per_pixel(plan));
    out << "  in all " << plan.steps.size()
        << (plan.steps.size() == 1 ? " dispatch, " : " dispatches, ") << bytes
        << " bytes a pixel\n";
    std::istringstream rest(
        sequence::layers_text(planned.layers) +
        (planned.layer_cost ? sequence::layer_cost_text(*planned.layer_cost) : std::string()) +
        sequence::estimate_text(planned.memory, seconds));
    for (std::string line; std::getline(rest, line);) out << "  " << line << "\n";
    return out.str();
}

// Abbreviates a frame whose summary differs only in the number: "frame 3: as frame 1".
class PlanSummaries {
  public:
    std::string add(int frame, const std::string& summary) {
        // The part after the frame number.
        const size_t prefix = concat("frame ", frame).size();
        if (!text_.empty() && summary.substr(prefix) == text_)
            return concat("frame ", frame, ": as frame ", shown_, "\n");
        text_ = summary.substr(prefix);
        shown_ = frame;
        return summary;
    }

  private:
    int shown_ = 0;  // frame whose text this is
    std::string text_;
};

Result<int> plan_subcommand(const Options& options, const PlanSettings& plan) {
    ASSIGN_OR_RETURN(auto chain, load_chain_of(options));
    ASSIGN_OR_RETURN(auto settings, run_settings_of(options));
    Calibration calibration;
    if (!plan.calibration.empty()) {
        ASSIGN_OR_RETURN(calibration,
                         sequence::read_calibration(plan.calibration).at("--calibration"));
    }
    io::set_exr_threads(sequence::threads_of(options.threads));
    Status first_failure;
    size_t good = 0;
    PlanSummaries summaries;
    const auto print = [&](const sequence::PlanReport& planned) {
        const auto seconds = seconds_of(planned, calibration);
        if (plan.format == "json") {
            io::Json json = sequence::planned_json(planned, seconds);
            if (!planned.warnings.empty()) json["warnings"] = planned.warnings;
            print_line(json);
            return;
        }
        const std::string text = plan.format == "dot" ? plan_as_dot(*planned.plan)
                                 : options.verbose
                                     ? verbose_text(planned, seconds)
                                     : summaries.add(planned.plan->frame_number,
                                                     plan_summary(chain.chain, planned, seconds));
        print_text(text);
    };
    FrameErrors errors;
    std::string said;  // of the previous frame, without its path
    const auto show = [&](const sequence::PlanReport& planned) {
        for (const auto& warning : planned.warnings) log::warning(warning);
        if (planned.plan.ok()) {
            ++good;
            print(planned);
            return plan.most == 0 || good < size_t(plan.most);
        }
        // An error repeated for the next frame applies to every frame.
        const Status status = planned.plan.status();
        if (plan.format == "json")
            print_line({{"frame", planned.frame}, {"error", status.message()}});
        const std::string what = sequence::fault_of(status.message());
        if (status.code() == StatusCode::chain && what == said) return false;
        said = what;
        errors.add(planned.frame, status);
        if (first_failure.ok()) first_failure = status;
        return true;
    };
    const Status planned = sequence::plan_sequence(chain.chain, settings, show);
    errors.finish();
    RETURN_IF_ERROR(planned);
    return exit_code(first_failure, good);
}

}  // namespace

RunSubcommand add_plan(CLI::App& subcommand, Options& options) {
    const auto plan = std::make_shared<PlanSettings>();
    add_chain(subcommand, options);
    add_confine(subcommand, options);
    for (const char* group : {sequence::kInputGroup, sequence::kLayerGroup, sequence::kPlanGroup})
        add_settings(subcommand, job_parameters(), group, &options.job);
    auto* text = subcommand.add_flag_callback(
        "--text", [plan] { plan->format = "text"; },
        "readable text (default); -v adds dispatches and textures");
    auto* json = subcommand.add_flag_callback(
        "--json", [plan] { plan->format = "json"; }, "one JSON object per frame");
    subcommand
        .add_flag_callback(
            "--dot", [plan] { plan->format = "dot"; }, "graphviz")
        ->excludes(text)
        ->excludes(json);
    subcommand.add_option("--most", plan->most, "plan no more frames than this; 0 = all")
        ->check(number_within(CLI::Range(0, 1'000'000)))
        ->capture_default_str();
    subcommand
        .add_option("--calibration", plan->calibration,
                    "sidecar of a frame filtered on a similar machine, to estimate times")
        ->type_name("FILE");
    add_schema(subcommand, {"chain"});
    return [&options, plan] { return plan_subcommand(options, *plan); };
}

}  // namespace postchain
