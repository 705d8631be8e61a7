// The questions of a study's file, and the margins within which their answers are "no difference".
#pragma once

#include "config/reporter.h"
#include "tools/measure/study/study.h"

namespace postchain::study {

// Key `questions`: pairs of study.chains. Without it every pair is a question.
void read_questions(const TextNode& root, Study& study, Reporter& reporter);
// Key `margins`.
void read_margins(const TextNode& root, Study& study, Reporter& reporter);

}  // namespace postchain::study
