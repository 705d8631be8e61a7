#include "tools/sequence/record/frame_report.h"

namespace postchain::sequence {

const char* name_of(Outcome outcome) {
    switch (outcome) {
        case Outcome::written:
            return "written";
        case Outcome::skipped:
            return "skipped";
        case Outcome::held:
            return "held";
        case Outcome::missing:
            return "missing";
        case Outcome::failed:
            return "failed";
    }
    return "unknown";
}

}  // namespace postchain::sequence
