// Prints error and temporal error of chains on shots with exact ground truth, as Markdown tables
// (docs/stability.md).
//
//   exact_shots [--json=FILE] [--shot=NAME] [CHAIN...]
//
// CHAIN: a shipped chain or a file; default: the shipped chains that `kChains` names.
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include "config/chain_find.h"
#include "tests/stability/shots.h"
#include "tools/metrics/temporal.h"

namespace {

using namespace postchain;
using namespace postchain::test::stability;
using Json = nlohmann::ordered_json;

constexpr const char* kChains[] = {"paper", "realtime", "fast", "balanced", "best"};

struct Line {
    std::string shot;
    std::vector<Measured> of_chains;
};

std::string figure(const std::optional<double>& value, int digits) {
    if (!value) return "";
    char text[32];
    std::snprintf(text, sizeof(text), "%.*f", digits, *value);
    return text[0] == '0' ? text + 1 : text;
}

std::optional<double> value_of(const metrics::Values& values, const std::string& name) {
    for (const auto& [metric, value] : values)
        if (metric == name) return value;
    return std::nullopt;
}

// A shot without such pixels has no line.
void print(const char* title, const std::vector<std::string>& chains,
           const std::vector<Line>& lines, const std::string& metric, int digits) {
    std::printf("\n%s\n\n| shot |", title);
    for (const std::string& chain : chains) std::printf(" %s |", chain.c_str());
    std::printf("\n|---|%s", chains.empty() ? "" : "---|");
    for (size_t i = 1; i < chains.size(); ++i) std::printf("---|");
    for (const Line& line : lines) {
        if (!value_of(line.of_chains.front().means, metric)) continue;
        std::printf("\n| %s |", line.shot.c_str());
        for (const Measured& one : line.of_chains)
            std::printf(" %s |", figure(value_of(one.means, metric), digits).c_str());
    }
    std::printf("\n");
}

Json json_of(const std::optional<double>& value) {
    return value ? Json(*value) : Json(nullptr);
}

Json json_of(const Measured& measured) {
    Json json;
    for (const auto& [metric, mean] : measured.means) {
        json[metric]["mean"] = json_of(mean);
        for (const metrics::Values& frame : measured.frames)
            json[metric]["frames"].push_back(json_of(value_of(frame, metric)));
    }
    return json;
}

}  // namespace

int main(int argc, char** argv) {
    std::string json_path, only;
    std::vector<std::string> chains;
    for (int i = 1; i < argc; ++i) {
        const std::string word = argv[i];
        if (word.starts_with("--json="))
            json_path = word.substr(7);
        else if (word.starts_with("--shot="))
            only = word.substr(7);
        else
            chains.push_back(word);
    }
    if (chains.empty())
        for (const char* name : kChains)
            if (embedded_chain(name)) chains.push_back(name);
    std::vector<Line> lines;
    Json json;
    for (const Shot& shot : shots()) {
        if (!only.empty() && shot.name != only) continue;
        const auto frames = render(shot);
        Line line{shot.name, {}};
        for (const std::string& chain : chains) {
            line.of_chains.push_back(measure(frames, shipped_chain(chain)));
            json[shot.name][chain] = json_of(line.of_chains.back());
        }
        lines.push_back(std::move(line));
        std::fprintf(stderr, "%s\n", shot.name.c_str());
    }
    print("Error", chains, lines, "error", 4);
    print("Temporal error", chains, lines, "temporal_error", 3);
    for (const char* name : metrics::kPixelClassNames) {
        print(concat("Error, ", name).c_str(), chains, lines, concat("error_", name), 4);
        print(concat("Temporal error, ", name).c_str(), chains, lines,
              concat("temporal_error_", name), 3);
    }
    if (!json_path.empty()) std::ofstream(json_path) << json.dump(1) << "\n";
    return 0;
}
