// The matrix as one page: a file that opens from disk and needs no network. It shows failed cells
// and the worst of each limit as small PNG images: colors on their own scale, errors in magma.
//
//   Matrix --pictures_of: these cells measured again--> ImagedCheck
//   --matrix_as_page: into tools/page/stress--> HTML
#pragma once

#include <string>
#include <vector>

#include "tools/stress/matrix.h"

namespace postchain::stress {

struct Picture {
    std::string title;  // "input"
    std::string scale;  // meaning of black and white
    std::string png;    // the file's bytes
    int width = 0;
    int height = 0;
};

// One check of one cell as images: input, result, comparison (unless it is the input), error.
struct ImagedCheck {
    const CellResult* cell = nullptr;
    const Measured* measured = nullptr;
    std::string place;  // part of the frame that is shown, if not all
    std::vector<Picture> pictures;
};

// Images of the first kMaxImaged failed checks and of the worst cell of each known limit.
// `subjects`: the run's. Errors: as measure(); output: the PNG encoder's.
inline constexpr size_t kMaxImaged = 400;
Result<std::vector<ImagedCheck>> pictures_of(Executor& executor,
                                             const std::vector<Subject>& subjects,
                                             const Matrix& matrix);

// Images of one check; larger frames are cropped to the surroundings of the largest error. Result
// and comparison share a scale; non-finite values are magenta.
Result<ImagedCheck> imaged(const CheckImages& images);

struct PageFacts {
    std::string version;
    std::string renderer;
    std::string command;  // that made it
};
std::string matrix_as_page(const Matrix& matrix, const std::vector<ImagedCheck>& imaged,
                           const PageFacts& facts);

}  // namespace postchain::stress
