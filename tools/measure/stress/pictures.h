// Exhibits as small PNG pictures: colors on one scale of their own, errors in magma.
//
//   Matrix --pictures_of: cells that failed and the worst of each limit, measured again-->
//   PicturedCheck
#pragma once

#include <string>
#include <vector>

#include "tools/measure/stress/matrix.h"

namespace postchain::stress {

struct Picture {
    std::string title;  // "input"
    std::string scale;  // what black and white stand for
    std::string png;    // the file's bytes
    int width = 0;
    int height = 0;
};

// One check of one cell, as pictures: input, result, what it was compared with where that is not
// the input, error.
struct PicturedCheck {
    const CellResult* cell = nullptr;
    const Measured* measured = nullptr;
    std::string place;  // which part of the frame is shown, where not all of it
    std::vector<Picture> pictures;
};

// Of every failed check (the first kMaxPictured of them) and of the worst cell of each known limit.
// `subjects` are those of the run. Errors: as measure(); output: the PNG encoder's.
inline constexpr size_t kMaxPictured = 400;
Result<std::vector<PicturedCheck>> pictures_of(Executor& executor,
                                               const std::vector<Subject>& subjects,
                                               const Matrix& matrix);

// Pictures of one exhibit; larger frames are cut to the surroundings of the largest error. What
// is compared shares a scale; what is not finite is magenta.
Result<PicturedCheck> pictured(const Exhibit& exhibit);

}  // namespace postchain::stress
