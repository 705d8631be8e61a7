// The page of a study: one HTML file without scripts, whose links lead to the scenes' reports.
#pragma once

#include <string>

#include "tools/measure/study/study_report.h"

namespace postchain::study {

std::string page_of(const StudyReport& report);

}  // namespace postchain::study
