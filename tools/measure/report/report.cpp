#include "tools/measure/report/report.h"

namespace postchain::report {

Status Report::write(const std::string& path, std::string_view text) const {
    ASSIGN_OR_RETURN(const auto permit, files.permit(path));
    return io::atomic_write_text(path, text, permit).status();
}

const char* name_of(Kind kind) {
    return kind == Kind::ab ? "ab" : "bench";
}

const char* name_of(Better better) {
    switch (better) {
        case Better::lower:
            return "lower";
        case Better::higher:
            return "higher";
        case Better::one:
            return "one";
    }
    return "unknown";
}

const char* words_of(Better better) {
    switch (better) {
        case Better::lower:
            return "lower is better";
        case Better::higher:
            return "higher is better";
        case Better::one:
            return "best at 1";
    }
    return "unknown";
}

const char* name_of(Finding finding) {
    switch (finding) {
        case Finding::too_few_frames:
            return "too_few_frames";
        case Finding::no_measurable_difference:
            return "no_measurable_difference";
        case Finding::a_better:
            return "a_better";
        case Finding::b_better:
            return "b_better";
    }
    return "unknown";
}

const char* name_of(ImageKind kind) {
    switch (kind) {
        case ImageKind::input:
            return "input";
        case ImageKind::truth:
            return "truth";
        case ImageKind::color:
            return "color";
        case ImageKind::error:
            return "error";
        case ImageKind::converged:
            return "converged";
    }
    return "unknown";
}

const StoredImage* Report::find(ImageKind of, int variant, int frame,
                                const std::string& map) const {
    for (const StoredImage& image : images)
        if (image.kind == of && image.variant == variant && image.frame == frame &&
            image.map == map)
            return &image;
    return nullptr;
}

}  // namespace postchain::report
