// The reader of requests for each user: with the user's own folders.
#pragma once

#include <string>

#include "tools/service/store/users.h"
#include "tools/service/work/job_request.h"

namespace postchain::service {

struct ReadJob {
    JobReader reader;
    JobRequest request;
};

class Readers {
  public:
    // The arguments outlive this object.
    Readers(const JobReader& all, const Users& users) : all_(all), users_(users) {}

    // Errors (usage): a folder of the user no longer exists.
    Result<JobReader> of(const User& user) const;
    // Errors (usage): as above, or the user is no longer known.
    Result<JobReader> of(const std::string& owner) const;
    // Reads a job again. Errors: as above, or those of its body.
    Result<ReadJob> read(const Job& job) const;
    std::string shown_in(const std::string& text) const { return all_.roots().shown_in(text); }

  private:
    const JobReader& all_;
    const Users& users_;
};

}  // namespace postchain::service
