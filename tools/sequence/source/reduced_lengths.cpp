#include "tools/sequence/source/reduced_lengths.h"

#include <cmath>

namespace postchain::sequence {

void reduce_lengths(Chain& chain, double scale) {
    for (ChainLink& link : chain.links)
        for (const Parameter& row : link.type->parameters->rows()) {
            if (row.unit != "px") continue;
            const ParameterValue value = row.get(link.pass->parameters());
            ParameterValue reduced;
            if (const auto* whole = std::get_if<int64_t>(&value))
                reduced = int64_t(std::llround(double(*whole) * scale));
            else if (const auto* number = std::get_if<double>(&value))
                reduced = *number * scale;
            if (row.check(reduced).ok() && reduced != ParameterValue())
                row.set(link.pass->parameters(), reduced);
        }
}

}  // namespace postchain::sequence
