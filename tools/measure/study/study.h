// A study: ab or bench over several scenes, read from its file.
//
//   YAML or JSON --study_reader.h--> Study --tasks_of()--> Tasks: one call of ab or bench each
//
// Settings of scenes are the rows of settings/job_settings.h and experiment/settings.h.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "chain/base/parameter.h"
#include "chain/pass/pass.h"
#include "tools/measure/experiment/settings.h"
#include "tools/measure/experiment/sweep.h"
#include "tools/measure/report/report.h"
#include "tools/sequence/files/atomic_file.h"
#include "tools/sequence/settings/job_settings.h"

namespace postchain::study {

struct Scene {
    std::string name;
    std::string family;    // scenes of one family count once; the scene's name if none is given
    std::string input;     // as typed
    std::string truth;     // as typed; empty: none
    std::string settings;  // all of them, as typed and in one line
    experiment::BenchSettings measured;  // with `run`; ab uses the settings it has
};

// A property that both chains of a question have in common.
enum class Equal { unsaid, samples, time };
const char* name_of(Equal equal);  // "samples"

// Samples that the passes of a chain take for a pixel: the sum of their rows "samples" that are
// read.
int samples_of(const Chain& chain);

struct Study {
    std::string file;
    std::string title;
    report::Kind kind = report::Kind::ab;
    std::string chain_name;                        // the title, or the name of the swept chain
    std::vector<experiment::NamedChain> chains;    // or the variants of one
    std::vector<std::string> chain_files;          // as typed
    std::vector<std::pair<size_t, size_t>> pairs;  // indices of A and B
    std::vector<Equal> equal;                      // by pair
    std::map<std::string, double> margins;         // by metric, instead of the defaults
    std::vector<Scene> scenes;

    // Adds a question.
    void ask(size_t a, size_t b, Equal same = Equal::unsaid);
    std::vector<std::string> names() const;  // names of the chains
};

// One call of ab or bench: a scene and, for ab, a pair.
struct Task {
    std::string name;  // "wheels.lens_vs_joint", "wheels"; a file name
    size_t scene = 0;
    std::optional<size_t> pair;
};
// Scene by scene.
std::vector<Task> tasks_of(const Study& study);

// Settings of a study outside its file.
struct StudySettings {
    std::string folder;
    std::string chunk;  // "2/4" of the tasks; empty: all
    io::OnExisting on_existing = io::OnExisting::skip;
};
// Rows of the group kSplitGroup split a study by hand.
inline constexpr const char* kSplitGroup = "split";
const ParameterTable& study_parameters();  // over StudySettings

}  // namespace postchain::study
