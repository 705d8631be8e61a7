#include "tools/measure/study/study.h"

#include "tools/measure/experiment/experiment.h"

namespace postchain::study {

const char* name_of(Equal equal) {
    constexpr const char* kNames[] = {"", "samples", "time"};
    return kNames[size_t(equal)];
}

namespace {

// 0 if the pass has no such row or does not read it.
int count_of(const ChainLink& link, const char* key) {
    const Parameter* row = link.type->parameters->find(key);
    if (!row || !experiment::reads(link, *row)) return 0;
    const auto value = row->get(link.pass->parameters());
    const auto* count = std::get_if<int64_t>(&value);
    return count ? int(*count) : 0;
}

}  // namespace

int samples_of(const Chain& chain) {
    int samples = 0;
    for (const auto& link : chain.links) samples += count_of(link, "samples");
    return samples;
}

void Study::ask(size_t a, size_t b, Equal same) {
    pairs.emplace_back(a, b);
    equal.push_back(same);
}

std::vector<std::string> Study::names() const {
    std::vector<std::string> names;
    for (const auto& chain : chains) names.push_back(chain.name);
    return names;
}

std::vector<Task> tasks_of(const Study& study) {
    std::vector<Task> tasks;
    for (size_t s = 0; s < study.scenes.size(); ++s) {
        const std::string& scene = study.scenes[s].name;
        if (study.kind == report::Kind::bench) {
            tasks.push_back({scene, s, std::nullopt});
            continue;
        }
        for (size_t p = 0; p < study.pairs.size(); ++p)
            tasks.push_back({scene + "." + study.chains[study.pairs[p].first].name + "_vs_" +
                                 study.chains[study.pairs[p].second].name,
                             s, p});
    }
    return tasks;
}

const ParameterTable& study_parameters() {
    static const ParameterTable table =
        ParameterTableBuilder<StudySettings>()
            .text("output", &StudySettings::folder,
                  {.unit = "DIR",
                   .help = "folder of the study; created if it does not exist",
                   .required = true})
            .choice("on_existing", &StudySettings::on_existing, {"fail", "overwrite", "skip"},
                    {.help = "if the folder has a study; skip: results of the same chains, "
                             "settings and files are kept"})
            .text("chunk", &StudySettings::chunk,
                  {.unit = "I/N",
                   .help = "only the I-th of N parts of the work, for a farm: 3/8",
                   .unset_means = "all of the work",
                   .group = kSplitGroup})
            .table();
    return table;
}

}  // namespace postchain::study
