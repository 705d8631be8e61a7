// postchain study: ab or bench over several scenes, with messages, progress and signals.

#pragma once

#include "tools/apps/postchain/options.h"
#include "tools/measure/study/study.h"

namespace postchain {

struct StudyOptions {
    std::string file;
    study::StudySettings settings;
};
void add_study(CLI::App& subcommand, Options& options, StudyOptions& study);
int study_subcommand(const Options& options, const StudyOptions& study, int argc, char** argv);

}  // namespace postchain
