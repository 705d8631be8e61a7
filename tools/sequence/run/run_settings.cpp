#include "tools/sequence/run/run_settings.h"

#include <algorithm>

namespace postchain::sequence {

RunSettings settings_for(RunSettings settings, const std::vector<const Chain*>& chains) {
    std::vector<std::string>& mattes = settings.source.layers.mattes;
    for (const Chain* chain : chains)
        for (const std::string& name : mattes_of(*chain))
            if (std::find(mattes.begin(), mattes.end(), name) == mattes.end())
                mattes.push_back(name);
    return settings;
}

}  // namespace postchain::sequence
