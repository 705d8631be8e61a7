#include "tools/measure/study/settings.h"

namespace postchain::study {

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
