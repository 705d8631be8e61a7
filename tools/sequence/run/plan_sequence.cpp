#include "tools/sequence/run/plan_sequence.h"

#include "chain/plan_print.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/record/layers_json.h"
#include "tools/sequence/run/plan_warnings.h"
#include "tools/sequence/settings/frame_task.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::sequence {

Status plan_sequence(const Chain& chain, const RunSettings& asked, const PlanVisitor& visitor) {
    const RunSettings settings = settings_for(asked, {&chain});
    ASSIGN_OR_RETURN(auto list, io::find_frames(settings.input, settings.frames));
    SequenceReader reader(settings.source, settings.input, [&](const FrameHeader& header) {
        return planes_needed(chain, settings.source, header, settings.plan);
    });
    const auto plan_of = [&](int frame, PlannedFrame& planned) -> Result<Plan> {
        const auto files = list.files.find(frame);
        if (files == list.files.end())
            return Status(StatusCode::input,
                          absent_files(frame, settings) + ": frame is not on disk");
        ASSIGN_OR_RETURN(auto inputs, reader.open(frame, files->second));
        ASSIGN_OR_RETURN(auto source, reader.read(inputs));
        planned.warnings = source.warnings;
        planned.layers = source.layers;
        auto plan = plan_source_frame(chain, source, settings.plan);
        if (!plan.ok()) return plan;
        for (auto& warning : plan_warnings(chain, *plan, source))
            planned.warnings.push_back(std::move(warning));
        planned.resolved = resolve_values(chain, source, *plan);
        ASSIGN_OR_RETURN(planned.layer_cost, layer_cost(chain, *plan, source, settings.plan));
        planned.memory = memory_of(inputs, *plan, list.frames.size());
        return plan;
    };
    for (int frame : list.frames) {
        PlannedFrame planned{frame, Status(StatusCode::internal, "not planned"), {}, {}, {}, {},
                             {}};
        planned.plan = plan_of(frame, planned);
        if (!visitor(planned)) break;
    }
    return Status();
}

io::Json planned_json(const PlannedFrame& planned, const std::optional<Seconds>& seconds) {
    io::Json json = io::json_from(plan_json(*planned.plan));
    if (planned.resolved) json["resolved"] = resolved_json(*planned.resolved);
    if (io::Json layers = layers_json(planned.layers, {}); !layers.empty())
        json["layers"] = std::move(layers);
    if (planned.layer_cost) json["layer_cost"] = layer_cost_json(*planned.layer_cost);
    json["estimate"] = estimate_json(planned.memory, seconds);
    return json;
}

}  // namespace postchain::sequence
