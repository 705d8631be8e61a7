#include "tests/bench/shot.h"

#include "tests/bench/bench_frame.h"
#include "tools/measure/experiment/experiment_input.h"

namespace postchain::bench {

Shot take_shot(Arguments& arguments) {
    return {arguments.text("--input").value_or(""), arguments.text("--frames").value_or(""),
            arguments.text("--camera").value_or("")};
}

std::vector<Frame> read_shot(const Shot& input, RoleSet wanted) {
    sequence::RunSettings run;
    run.input = require(io::InputSpec::parse(input.pattern));
    if (!input.frames.empty()) run.frames = require(io::FrameRange::parse(input.frames));
    if (!input.camera.empty()) {
        run.source.camera = require(load_camera(input.camera));
        require(run.source.camera->status());
    }
    experiment::ExperimentInput shot;
    const auto list = require(experiment::frames_on_disk(run));
    shot.files = list.files;
    std::vector<Frame> frames;
    for (const int number : list.frames) {
        auto source = require(experiment::read_frame(shot, run, number, wanted));
        frames.push_back({source.description, source.planes});
    }
    return frames;
}

}  // namespace postchain::bench
