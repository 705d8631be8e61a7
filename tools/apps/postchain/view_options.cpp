#include "tools/apps/postchain/view_options.h"

#include <CLI/CLI.hpp>

namespace postchain {

void add_view(CLI::App& subcommand, Options& options, ViewOptions& view) {
    add_chain(subcommand, options);
    for (const char* group : {sequence::kInputGroup, sequence::kPlanGroup})
        add_settings(subcommand, job_parameters(), group, &options.job);
    for (const char* key : {"ocio_display", "ocio_view"})
        add_setting(subcommand, *job_parameters().find(key), &options.job);
    subcommand.add_option("-r,--truth", view.truth, "ground truth to compare with, as for --input")
        ->type_name("IN");
    subcommand.add_option("--beside", view.other, "another chain to compare with")
        ->type_name("CHAIN");
    subcommand
        .add_option("--shaders", view.shaders,
                    "folder with GLSL sources, compiled again after each change")
        ->type_name("DIR");
    subcommand.add_option("--frame", view.frame, "frame to begin with")->type_name("N");
    subcommand.add_option("--size", view.size, "width x height of the window")
        ->capture_default_str();
    subcommand
        .add_option("--ui-scale", view.ui_scale, "size of text and widgets (default: the screen's)")
        ->check(number_within(0.5, 4));
    subcommand
        .add_option("--state-file", view.state_file,
                    "JSON file with the viewer's state, for programs that drive it; written "
                    "again after each change")
        ->type_name("FILE");
    add_device(subcommand, options);
}

}  // namespace postchain
