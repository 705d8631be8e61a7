#include "tools/service/work/planned.h"

#include "config/chain_file.h"
#include "config/reporter.h"
#include "tools/sequence/files/json.h"
#include "tools/sequence/run/plan_sequence.h"
#include "tools/service/work/json_body.h"

namespace postchain::service {
namespace {

constexpr int kMaxPlannedFrames = 100;  // per request

}  // namespace

Answer<std::string> plan_of(const std::string& body, const JobReader& reader) {
    auto read = reader.plan(body);
    if (const auto* refused = std::get_if<Problem>(&read)) return *refused;
    JobRequest& request = std::get<JobRequest>(read);
    const Roots& roots = reader.roots();
    try {
        if (Status status = check_inputs(request.run.input, roots); !status.ok())
            return problem_of(status, roots);
        const int most = request.run.frames ? kMaxPlannedFrames : 1;
        io::Json frames = io::Json::array();
        const Status status = sequence::plan_sequence(
            request.chain.chain, request.run, [&](const sequence::PlannedFrame& planned) {
                io::Json frame = {{"frame", planned.frame}};
                if (planned.plan.ok())
                    frame["plan"] = sequence::planned_json(planned, std::nullopt);
                else
                    frame["error"] = roots.shown_in(planned.plan.status().message());
                frame["warnings"] = request.warnings;
                for (const std::string& warning : planned.warnings)
                    frame["warnings"].push_back(roots.shown_in(warning));
                frames.push_back(std::move(frame));
                return int(frames.size()) < most;
            });
        if (!status.ok()) return problem_of(status, roots);
        return io::json_text({{"frames", std::move(frames)}});
    } catch (...) {
        return problem_of(status_of_exception("the plan"), roots);
    }
}

Answer<Diagnostics> chain_faults(const std::string& body, const PassRegistry& registry) {
    TextTree tree = read_json_body(body);
    const TextNode* text = tree.root.find("text");
    if (!has_errors(tree.diagnostics) && !(text && is_string(*text)))
        Reporter(kBodyFile, StatusCode::usage, tree.diagnostics)
            .error(text ? *text : tree.root, "text", "missing, or not a chain file's text");
    if (has_errors(tree.diagnostics))
        return refusal(Problem::Kind::invalid, std::move(tree.diagnostics));
    return parse_chain(text->text, "chain", registry).diagnostics;
}

}  // namespace postchain::service
