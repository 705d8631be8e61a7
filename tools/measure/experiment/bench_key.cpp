#include "tools/measure/experiment/bench_key.h"

#include "tools/measure/experiment/converge.h"
#include "tools/sequence/record/fingerprint.h"
#include "tools/sequence/source/frame_plan.h"
#include "tools/sequence/source/sequence_reader.h"

namespace postchain::experiment {
namespace {

Result<std::string> files_of(const Chain& chain, int frame, const BenchSettings& settings,
                             const Basis& basis) {
    sequence::SequenceReader reader(
        settings.run.source, settings.run.input, [&](const sequence::FrameHeader& header) {
            return sequence::planes_needed(chain, settings.run.source, header, settings.run.plan);
        });
    ASSIGN_OR_RETURN(const auto inputs, reader.open(frame, basis.files.at(frame)));
    std::string work = sequence::fingerprint_of(chain, settings.run, inputs);
    if (basis.has_truth(frame)) work += " truth " + basis.truth->identity(frame);
    return work;
}

}  // namespace

std::string conditions_of(const report::Report& report, const BenchSettings& settings,
                          const std::vector<BenchVariant>& variants) {
    std::string text =
        concat("results 3\n", report.version, "\n", report.renderer, "\n", report.threads, "\n",
               report.precision, "\n", report.tone_mapper, " ", settings.flip.pixels_per_degree,
               " ", report.exposure_start, " ", report.exposure_stop, "\n", kConvergedSeeds, " ",
               settings.repeats, "\n", report.reference, "\n");
    RuleNames rules;
    for (const auto& variant : variants) rules.merge(settings.run.plan.rules(variant.chain));
    for (const auto& rule : rules) text += rule + "\n";
    return text;
}

Result<std::string> work_on(const Chain& chain, int frame, const std::string& more,
                            const BenchSettings& settings, const Basis& basis) {
    ASSIGN_OR_RETURN(auto work, files_of(chain, frame, settings, basis));
    if (!basis.follows(frame)) return work + more;
    ASSIGN_OR_RETURN(auto before, files_of(chain, frame - 1, settings, basis));
    return work + more + " after " + before;
}

}  // namespace postchain::experiment
