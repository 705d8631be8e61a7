// postchain serve: jobs over HTTP (docs/service.md).
#pragma once

#include <string>
#include <vector>

#include "tools/apps/postchain/options.h"

namespace postchain {

enum class ServeBackend { local, slurm };

struct ServeOptions {
    std::vector<std::string> roots;
    std::string store;  // empty = in the state folder of the user or system
    int port = 8080;
    std::string bind = "127.0.0.1";
    std::string token_file;
    std::string users;
    std::vector<std::string> trusted;  // proxies
    std::string base_path;
    double frame_timeout_s = 1800;
    double slice_s = 60;
    int keep_jobs = 1000;
    int keep_days = 0;
    std::string backup;
    ServeBackend backend = ServeBackend::local;
    std::string farm_folder;
    std::string farm_program;
    std::string farm_memory;
    int farm_frames = 8;
    std::vector<std::string> slurm_words;
    std::vector<std::string> hosts;
    int attempts = 3;
    int max_queue = 1000;
    int max_connections = 4096;
    int max_connections_per_address = 2048;
};
void add_serve(CLI::App& subcommand, Options& options, ServeOptions& serve);
int serve_subcommand(const Options& options, const ServeOptions& serve);

}  // namespace postchain
