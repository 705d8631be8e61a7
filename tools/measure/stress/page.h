// The matrix as one page: a file that opens from disk and needs no network.
//
//   Matrix --pictures.h--> ImagedCheck --matrix_as_page: into tools/page/stress--> HTML
#pragma once

#include <string>
#include <vector>

#include "tools/measure/stress/matrix.h"
#include "tools/measure/stress/pictures.h"

namespace postchain::stress {

struct PageFacts {
    std::string version;
    std::string renderer;
    std::string command;  // that made it
};
std::string matrix_as_page(const Matrix& matrix, const std::vector<ImagedCheck>& imaged,
                           const PageFacts& facts);

}  // namespace postchain::stress
