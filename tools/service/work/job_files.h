// The files of a job that a reply shows: sidecars, thumbnails, reports, outputs.
#pragma once

#include <string>
#include <vector>

#include "tools/service/store/job_store.h"
#include "tools/service/work/readers.h"
#include "tools/service/work/service.h"

namespace postchain::service {

// The sidecar beside an output, if the roots have it; empty = none.
std::string sidecar_of(const std::string& output, const Roots& roots);

// A frame before or after filtering.
Answer<Picture> thumbnail_of(const Job& job, const JobFrame& frame, bool after,
                             const JobReader& reader);

Answer<ResultFile> report_file_of(const Job& job, const std::string& name, const JobReader& reader);

// The outputs of finished frames first..last. Problems: not_found, if there is none.
Answer<std::vector<ResultFile>> outputs_of(const std::vector<JobFrame>& frames, int first, int last,
                                           const Roots& roots);

}  // namespace postchain::service
