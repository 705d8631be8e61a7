// A small report whose pictures follow from their coordinates; page_test.py has the same formulas.
#pragma once

#include <string>

#include "tools/measure/report/report.h"

namespace postchain::report::testing {

inline constexpr int kWidth = 96, kHeight = 64;
inline constexpr int kFrames[] = {1001, 1002};
inline constexpr int kGood = 3;  // variants with pictures; one more has failed

// Variant v, linear RGB: (x + 1/2) / 96 * 2^v, halved in the second frame; (y + 1/2) / 64;
// (v + 1) / 4. In variant 1 the pixels (5,7), (6,7), (7,7) hold NaN, 1e6 and -1 in red. The truth
// is variant 0 with twice the green.
ImageF variant_image(int variant, int frame);
ImageF truth_image(int frame);
// HDR-FLIP: x / 95 * (v + 1) / 3. FLIP: the same from the other side.
ImageF error_map(int variant, bool from_the_right = false);

// Writes the pictures to folder/images and returns the report.
Report make_report(const std::string& folder);
// The same without a truth: variants 0 and 1 share a converged picture, that of the truth; variant
// 2's is 1/4 everywhere.
Report make_blind_report(const std::string& folder);
// The first with a score of the input, whose HDR-FLIP map is x / 95, a winner (variant 1), a
// warning and the truth's noise.
Report make_scored_report(const std::string& folder);
// Variants 0 and 1 of that compared: 0 has won, two of three metrics without a finding.
Report make_ab_report(const std::string& folder);
// The same with too few frames for any finding, and with equal MSE.
Report make_undecided_report(const std::string& folder);
// make_ab_report() with relMSE in place of MSE: 0.5 of both variants, 0.125 of the input.
Report make_relative_report(const std::string& folder);

}  // namespace postchain::report::testing
