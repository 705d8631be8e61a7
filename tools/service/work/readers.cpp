#include "tools/service/work/readers.h"

namespace postchain::service {

Result<JobReader> Readers::of(const User& user) const {
    if (user.roots.empty()) return all_;
    auto roots = all_.roots().within(user.roots);
    if (!roots.ok()) return roots.status();
    return all_.with(std::move(*roots));
}

Result<JobReader> Readers::of(const std::string& owner) const {
    const KnownUser user = users_.named(owner);
    // Jobs from before there were users, and jobs of a service that no longer has any.
    if (!user && (owner.empty() || users_.named(""))) return all_;
    if (!user)
        return Status(StatusCode::usage, "user '" + owner +
                                             "' is no longer in the file of users; add the user "
                                             "again and retry the job");
    return of(*user);
}

}  // namespace postchain::service
