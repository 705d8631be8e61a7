#include "tools/sequence/run/plan_sequence.h"

#include "tools/sequence/run/plan_warnings.h"
#include "tools/sequence/run/sequence_reader.h"

namespace postchain::sequence {

Status plan_sequence(const Chain& chain, const RunSettings& settings, const PlanVisitor& visitor) {
    auto list = io::find_frames(settings.input, settings.frames);
    if (!list.ok()) return list.status();
    SequenceReader reader(settings.source, settings.input, [&](const FrameHeader& header) {
        return planes_needed(chain, settings.source, header, settings.plan);
    });
    const auto plan_of = [&](int frame, std::vector<std::string>& warnings) -> Result<Plan> {
        const auto files = list->files.find(frame);
        if (files == list->files.end())
            return Status(StatusCode::input,
                          settings.input.color().format(frame) + ": frame is not on disk");
        auto inputs = reader.open(frame, files->second);
        if (!inputs.ok()) return inputs.status();
        auto source = reader.read(*inputs);
        if (!source.ok()) return source.status();
        warnings = source->warnings;
        auto plan = plan_source_frame(chain, *source, settings.plan);
        if (plan.ok())
            for (auto& warning : plan_warnings(chain, *plan, *source))
                warnings.push_back(std::move(warning));
        return plan;
    };
    for (int frame : list->frames) {
        std::vector<std::string> warnings;
        Result<Plan> plan = plan_of(frame, warnings);
        if (!visitor({frame, std::move(plan), std::move(warnings)})) break;
    }
    return Status();
}

}  // namespace postchain::sequence
