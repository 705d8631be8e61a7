#include "tools/measure/tune/knobs.h"

#include <algorithm>

#include "chain/base/text.h"

namespace postchain::tune {
namespace {

// Fewer samples show patterns instead of noise.
constexpr int64_t kMinSamples = 4;

bool is_knob(const Parameter& row) {
    return std::ranges::find(knob_keys(), row.key) != knob_keys().end();
}

std::vector<const Parameter*> knobs_of(const ChainLink& link) {
    std::vector<const Parameter*> rows;
    for (const Parameter& row : link.type->parameters->rows())
        if (is_knob(row) && link.type->parameters->unread(row, link.pass->parameters()).empty())
            rows.push_back(&row);
    return rows;
}

// From cheap to expensive.
std::vector<ParameterValue> values_of(const Parameter& row) {
    std::vector<ParameterValue> values;
    switch (row.type) {
        case ParameterType::boolean:
            values = {false, true};
            break;
        case ParameterType::choice:
            values.assign(row.choices.begin(), row.choices.end());
            break;
        case ParameterType::integer: {
            const int64_t least = row.convergence == Convergence::set ? kMinSamples : 1;
            for (int64_t value = least; double(value) <= row.soft_max; value *= 2)
                values.push_back(row.odd ? value + 1 : value);
            break;
        }
        default:
            break;
    }
    std::erase_if(values, [&](const ParameterValue& value) { return !row.check(value).ok(); });
    return values;
}

// The next cheaper (direction -1) or more expensive (+1) value. The present value of a whole number
// need not be one of them. Unset at the end.
ParameterValue value_beside(const Parameter& row, const ParameterValue& now, int direction) {
    const std::vector<ParameterValue> values = values_of(row);
    const auto rank = [&](const ParameterValue& value) {
        if (const auto* number = std::get_if<int64_t>(&value)) return *number;
        return int64_t(std::ranges::find(values, value) - values.begin());
    };
    const int64_t from = rank(now);
    if (direction > 0) {
        for (const ParameterValue& value : values)
            if (rank(value) > from) return value;
    } else {
        for (auto value = values.rbegin(); value != values.rend(); ++value)
            if (rank(*value) < from) return *value;
    }
    return {};
}

Chain with_value(const Chain& chain, size_t link, const Parameter& row,
                 const ParameterValue& value) {
    Chain copy = chain.clone();
    row.set(copy.links[link].pass->parameters(), value);
    return copy;
}

}  // namespace

const std::vector<std::string>& knob_keys() {
    static const std::vector<std::string> keys = {"samples", "starts", "neighbors", "denoise"};
    return keys;
}

std::vector<Step> steps_from(const Chain& chain, const std::vector<std::string>& fixed,
                             bool order) {
    std::vector<Step> steps;
    for (size_t i = 0; i < chain.links.size(); ++i) {
        const ChainLink& link = chain.links[i];
        for (const Parameter* row : knobs_of(link)) {
            const std::string name = link.type->name + "." + row->key;
            if (std::ranges::find(fixed, name) != fixed.end()) continue;
            const ParameterValue now = row->get(link.pass->parameters());
            for (const auto& [direction, cost] :
                 {std::pair{-1, Cost::less}, std::pair{1, Cost::more}}) {
                const ParameterValue value = value_beside(*row, now, direction);
                if (value == ParameterValue()) continue;
                steps.push_back({with_value(chain, i, *row, value), cost});
            }
        }
    }
    for (size_t i = 0; order && i + 1 < chain.links.size(); ++i) {
        Chain swapped = chain.clone();
        std::swap(swapped.links[i], swapped.links[i + 1]);
        steps.push_back({std::move(swapped), Cost::same});
    }
    return steps;
}

std::vector<std::string> fixed_knobs(const Chain& chain, const std::vector<std::string>& sets) {
    std::vector<std::string> fixed;
    for (const std::string& set : sets) {
        const std::string path = set.substr(0, set.find('='));
        for (size_t i = 0; i < chain.links.size(); ++i) {
            const std::string& type = chain.links[i].type->name;
            for (const Parameter& row : chain.links[i].type->parameters->rows()) {
                if (!is_knob(row)) continue;
                const std::string name = type + "." + row.key;
                if (path == name || path == concat("passes[", i, "].", row.key))
                    fixed.push_back(name);
            }
        }
    }
    return fixed;
}

Chain without_shortcuts(const Chain& chain) {
    Chain copy = chain.clone();
    for (ChainLink& link : copy.links)
        for (const Parameter* row : knobs_of(link)) {
            const std::vector<ParameterValue> values = values_of(*row);
            // Denoising is a shortcut to more samples.
            const bool shortcut = row->type == ParameterType::boolean;
            row->set(link.pass->parameters(), shortcut ? values.front() : values.back());
        }
    return copy;
}

std::string knobs_text(const Chain& chain) {
    std::vector<std::string> passes;
    for (const ChainLink& link : chain.links) {
        std::string text = link.type->name;
        for (const Parameter* row : knobs_of(link))
            text += concat(" ", row->key, " ", text_of(row->get(link.pass->parameters())));
        passes.push_back(std::move(text));
    }
    return joined(passes);
}

}  // namespace postchain::tune
