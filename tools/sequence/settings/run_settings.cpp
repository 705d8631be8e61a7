#include "tools/sequence/settings/run_settings.h"

#include <algorithm>

namespace postchain::sequence {

std::set<std::string> RunSettings::ocio_configs() const {
    std::set<std::string> configs;
    if (source.input_transfer) configs.insert(io::config_of(*source.input_transfer));
    if (picture.transfer) configs.insert(io::config_of(*picture.transfer));
    if (view) configs.insert(view->config);
    configs.erase("");
    return configs;
}

RunSettings settings_for(RunSettings settings, const std::vector<const Chain*>& chains) {
    std::vector<std::string>& mattes = settings.source.layers.mattes;
    for (const Chain* chain : chains)
        for (const std::string& name : mattes_of(*chain))
            if (std::find(mattes.begin(), mattes.end(), name) == mattes.end())
                mattes.push_back(name);
    settings.source.layers.written = settings.exr;
    return settings;
}

}  // namespace postchain::sequence
