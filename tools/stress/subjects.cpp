#include "tools/stress/subjects.h"

#include "config/chain_find.h"

namespace postchain::stress {

Result<std::vector<Subject>> every_subject(const PassRegistry& passes) {
    std::vector<Subject> subjects;
    for (const auto& type : passes.types()) {
        Chain chain;
        chain.append(passes, type.name);
        subjects.push_back({type.name, std::move(chain)});
    }
    for (const char* name : {"paper", "dof_first"}) {
        ASSIGN_OR_RETURN(auto file, load_chain(name, passes));
        RETURN_IF_ERROR(file.status());
        subjects.push_back({name, std::move(file.chain)});
    }
    return subjects;
}

}  // namespace postchain::stress
