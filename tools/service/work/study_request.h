// The study of a request.
#pragma once

#include "tools/measure/study/study_reader.h"
#include "tools/service/work/request_body.h"

namespace postchain::service {

// A file, whose paths are relative to its folder, or an object, whose paths are relative to the
// first root.
void read_study(RequestBody& body, const Roots& roots, const PassRegistry& registry,
                const std::string& version, study::Study& study, study::StudySettings& settings);

}  // namespace postchain::service
