// The chains of a study's file.
#pragma once

#include "tools/measure/study/reading.h"

namespace postchain::study {

// Keys `chains` and `questions`.
void read_chains(const TextNode& root, Reading& reading);
// Keys `chain`, `sweep` and `max_variants`: variants of one chain.
void read_sweep(const TextNode& root, Reading& reading);

}  // namespace postchain::study
