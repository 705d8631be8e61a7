#include "tools/service/work/readers.h"

namespace postchain::service {

Result<JobReader> Readers::of(const User& user) const {
    if (user.roots.empty()) return all_;
    ASSIGN_OR_RETURN(auto roots, all_.roots().within(user.roots));
    return all_.with(std::move(roots));
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

Result<ReadJob> Readers::read(const Job& job) const {
    ASSIGN_OR_RETURN(auto reader, of(job.owner));
    auto read = reader.job(job.body);
    if (const auto* problem = std::get_if<Problem>(&read)) {
        const Status status = status_of(problem->diagnostics);
        return Status(status.ok() ? StatusCode::usage : status.code(), problem->detail);
    }
    return ReadJob{std::move(reader), std::get<JobRequest>(std::move(read))};
}

}  // namespace postchain::service
