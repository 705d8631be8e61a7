// postchain check: which outputs of sequences are whole, missing, or from other settings.
#include "tools/apps/postchain/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>

#include "tools/apps/common/log.h"
#include "tools/sequence/record/check_outputs.h"
#include "tools/sequence/settings/run_settings.h"

namespace postchain {
namespace {

struct CheckOptions {
    std::vector<std::string> outputs;
    std::string frames;
    std::string like;
};

using io::Json;
using sequence::CheckedOutput;
using sequence::OutputState;

double seconds_of(const CheckedOutput& one) {
    double ms = 0;
    if (const auto times = one.sidecar.find("times_ms");
        one.sidecar.is_object() && times != one.sidecar.end())
        for (const auto& [name, value] : times->items())
            if (value.is_number()) ms += value.get<double>();
    return ms * 1e-3;
}

struct Sequence {
    std::string pattern;
    std::map<OutputState, std::vector<int>> frames;
    uint64_t bytes = 0;
    double seconds = 0;
};

Sequence summary_of(const std::string& pattern, const std::vector<CheckedOutput>& outputs) {
    Sequence sequence{pattern, {}, 0, 0};
    for (const CheckedOutput& one : outputs) {
        sequence.frames[one.state].push_back(one.frame);
        sequence.bytes += one.bytes;
        sequence.seconds += seconds_of(one);
    }
    return sequence;
}

void print_table(const std::vector<Sequence>& sequences) {
    std::printf("%8s %8s %8s %8s %8s %10s %10s  %s\n", "whole", "missing", "damaged", "other",
                "foreign", "MB", "seconds", "output");
    for (const Sequence& one : sequences) {
        for (const OutputState state : sequence::kOutputStates) {
            const auto found = one.frames.find(state);
            std::printf("%8zu ", found == one.frames.end() ? 0 : found->second.size());
        }
        std::printf("%10.1f %10.1f  %s\n", double(one.bytes) * 1e-6, one.seconds,
                    one.pattern.c_str());
    }
    for (const Sequence& one : sequences)
        for (const auto& [state, frames] : one.frames)
            if (state != OutputState::whole)
                std::printf("%s: %s: %s\n", one.pattern.c_str(), name_of(state),
                            sequence::frames_text(frames, frames.size()).c_str());
}

Result<int> check_subcommand(const Options& options, const CheckOptions& check) {
    std::optional<io::FrameRange> frames;
    if (!check.frames.empty()) {
        ASSIGN_OR_RETURN(frames, io::FrameRange::parse(check.frames).at("--frames"));
    }
    std::vector<Sequence> sequences;
    Json all = Json::array();
    bool whole = true;
    for (const std::string& text : check.outputs) {
        ASSIGN_OR_RETURN(const auto pattern, io::PathPattern::parse(text));
        ASSIGN_OR_RETURN(const auto outputs, sequence::check_outputs(pattern, frames, check.like));
        sequences.push_back(summary_of(text, outputs));
        whole = whole && sequences.back().frames[OutputState::whole].size() == outputs.size();
        all.push_back(sequence::checked_json(text, outputs));
    }
    for (Sequence& one : sequences)
        std::erase_if(one.frames, [](const auto& state) { return state.second.empty(); });
    if (options.json)
        print_line({{"whole", whole}, {"sequences", all}});
    else
        print_table(sequences);
    return whole ? kExitOk : kExitSomeFailed;
}

}  // namespace

RunSubcommand add_check(CLI::App& subcommand, Options& options) {
    const auto check = std::make_shared<CheckOptions>();
    subcommand.add_option("OUT", check->outputs, "output pattern, as for --output of `run`")
        ->required()
        ->expected(1, -1);
    subcommand
        .add_option("--frames", check->frames,
                    "frames that must exist, such as 1-100 (default: from the first to the last on "
                    "disk)")
        ->type_name("RANGE");
    subcommand
        .add_option("--like", check->like,
                    "an output whose settings all frames must have (default: those of most frames)")
        ->type_name("OUT");
    subcommand.add_flag("--json", options.json, "one JSON object with every frame");
    return [&options, check] { return check_subcommand(options, *check); };
}

}  // namespace postchain
