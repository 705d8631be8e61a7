#include "tools/measure/stress/limits.h"

#include <algorithm>

namespace postchain::stress {
namespace {

const KnownLimit* limit_of(const ChainLink& link, const std::string& check,
                           const std::string& cell) {
    const std::string parameters = link.type->parameters->text(link.pass->parameters());
    const auto& limits = link.type->known_limits;
    const auto found = std::find_if(limits.begin(), limits.end(), [&](const KnownLimit& limit) {
        return limit.check == check && matches(limit.parameters, parameters) &&
               matches(limit.cells, cell);
    });
    return found == limits.end() ? nullptr : &*found;
}

}  // namespace

void apply_known_limits(const Chain& chain, CellResult& cell) {
    const std::string name = cell.name();
    for (auto& one : cell.measured) {
        if (one.verdict != Verdict::failed) continue;
        const KnownLimit* widest = nullptr;
        for (const auto& link : chain.links) {
            const KnownLimit* limit = limit_of(link, one.check, name);
            if (limit && (!widest || limit->bound > widest->bound)) widest = limit;
        }
        if (!widest) continue;
        if (one.value <= widest->bound) {
            one.verdict = Verdict::limit;
            one.limit = widest;
        } else {
            one.note += concat("; beyond the known limit ", widest->bound, ": ", widest->reason);
        }
    }
}

}  // namespace postchain::stress
