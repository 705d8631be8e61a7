#include "tools/measure/experiment/sweep.h"

#include <algorithm>
#include <set>

#include "config/chain_file.h"
#include "tools/sequence/image/bokeh_kernel_file.h"

namespace postchain::experiment {

Result<Sweep> parse_sweep(const std::string& text) {
    const size_t equals = text.find('=');
    Sweep sweep;
    sweep.key = text.substr(0, equals);
    if (equals == std::string::npos || sweep.key.empty())
        return Status(StatusCode::usage, "{sweep}: '"_keyed + text + "' is not PASS.KEY=V1,V2,...");
    std::string value;
    for (char c : text.substr(equals + 1) + ",") {
        if (c != ',') {
            value += c;
            continue;
        }
        if (value.empty())
            return Status(
                StatusCode::usage,
                "{sweep}: '"_keyed + text + "' has an empty value; remove the comma beside it");
        sweep.values.push_back(value);
        value.clear();
    }
    return sweep;
}

namespace {

// Sweep values are parsed by --set; rewrites its messages to name --sweep.
std::string as_sweeps(std::string message, const std::vector<Sweep>& sweeps) {
    for (const Sweep& sweep : sweeps) {
        const std::string typed = setting("set") + " " + sweep.key + "=";
        for (size_t at = 0; (at = message.find(typed, at)) != std::string::npos;)
            message.replace(at, setting("set").size(), setting("sweep"));
    }
    return message;
}

}  // namespace

Result<std::vector<NamedChain>> sweep_variants(const ChainText& chain, const PassRegistry& registry,
                                               const std::vector<std::string>& sets,
                                               const std::vector<Sweep>& sweeps, int max_variants) {
    size_t product = 1;
    std::set<std::string> keys;
    for (const Sweep& sweep : sweeps) {
        if (!keys.insert(sweep.key).second)
            return Status(StatusCode::usage,
                          concat("{sweep}: "_keyed, sweep.key,
                                 " is swept twice; put all its values into one sweep: ", sweep.key,
                                 "=V1,V2,..."));
        product *= sweep.values.size();
        if (product > size_t(max_variants))
            return Status(StatusCode::usage,
                          concat("{sweep}: the sweeps have more than "_keyed, max_variants,
                                 " combinations; try fewer values or raise {max_variants}"_keyed));
    }
    io::ApertureFiles pictures;
    std::vector<NamedChain> variants;
    std::set<std::string> known;
    for (size_t i = 0; i < product; ++i) {
        NamedChain variant;
        std::vector<std::string> overrides = sets;
        size_t rest = i, span = product;
        for (const Sweep& sweep : sweeps) {
            span /= sweep.values.size();
            const std::string& value = sweep.values[rest / span];
            rest %= span;
            variant.sweep.emplace_back(sweep.key, value);
            variant.name += concat(variant.name.empty() ? "" : " ", sweep.key, "=", value);
            overrides.push_back(sweep.key + "=" + value);
        }
        ChainFile file = parse_chain(chain, registry, overrides);
        if (Status status = file.status(); !status.ok())
            return Status(status.code(), as_sweeps(status.message(), sweeps));
        // If two sweeps set one value, the last would win and the variant's name would be wrong.
        std::reverse(overrides.begin() + std::ptrdiff_t(sets.size()), overrides.end());
        const ChainFile other = parse_chain(chain, registry, overrides);
        if (other.chain.text() != file.chain.text())
            return Status(StatusCode::usage,
                          concat("{sweep}: "_keyed, variant.name,
                                 ": two of the sweeps set the same value; put all its values into "
                                 "one sweep: KEY=V1,V2,..."));
        if (Status status = pictures.read(file.chain.camera); !status.ok())
            return status.at("camera.aperture_image");
        variant.chain = std::move(file.chain);
        if (!known.insert(variant.chain.text()).second) continue;
        if (variant.name.empty()) variant.name = "as it is";
        variants.push_back(std::move(variant));
    }
    return variants;
}

}  // namespace postchain::experiment
