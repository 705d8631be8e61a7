#include "tools/apps/postchain/serve.h"

#include <sys/resource.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>

#include "passes/registry.h"
#include "tools/apps/postchain/exit_code.h"
#include "tools/apps/postchain/log.h"
#include "tools/apps/postchain/notify.h"
#include "tools/apps/postchain/stop_on_signal.h"
#include "tools/service/http/server.h"
#include "tools/service/work/service.h"

namespace postchain {
namespace {

constexpr int kOtherFiles = 256;  // open files other than connections

// $STATE_DIRECTORY is the folder that systemd creates for the unit.
Result<std::string> store_of(const ServeOptions& serve) {
    if (!serve.store.empty()) return serve.store;
    const auto variable = [](const char* name) {
        const char* text = std::getenv(name);
        return std::string(text ? text : "");
    };
    std::string folder = variable("STATE_DIRECTORY");
    if (folder.empty()) {
        folder = variable("XDG_STATE_HOME");
        if (folder.empty() && !variable("HOME").empty())
            folder = variable("HOME") + "/.local/state";
        if (folder.empty())
            return Status(StatusCode::usage,
                          "--store: give a file; without HOME there is no default");
        folder += "/postchain";
    }
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error)
        return Status(StatusCode::output, concat("--store: ", folder, ": ", error.message()));
    return folder + "/jobs.sqlite";
}

// Raises the limit of open files for the connections, if the system allows it.
void allow_connections(int connections) {
    rlimit limit = {};
    if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return;
    const rlim_t wanted = rlim_t(connections + kOtherFiles);
    if (limit.rlim_cur >= wanted) return;
    limit.rlim_cur = std::min(wanted, limit.rlim_max);
    setrlimit(RLIMIT_NOFILE, &limit);
    if (limit.rlim_cur < wanted)
        log::warning(concat("this process may open ", limit.rlim_cur, " files, fewer than ",
                            "--max-connections ", connections, " needs"));
}

std::string address_text(const std::string& address, int port) {
    const bool six = address.find(':') != std::string::npos;
    return concat("http://", six ? "[" : "", address, six ? "]" : "", ":", port, "/");
}

Result<service::ServerSettings> server_settings(const Options& options, const ServeOptions& serve) {
    service::ServerSettings settings;
    settings.address = serve.bind;
    settings.port = uint16_t(serve.port);
    settings.version = kVersion;
    settings.max_connections = size_t(serve.max_connections);
    settings.max_connections_per_address = size_t(serve.max_connections_per_address);
    settings.guard.hosts = serve.hosts;
    std::array<char, 256> name = {};
    if (gethostname(name.data(), name.size() - 1) == 0)
        settings.guard.hosts.emplace_back(name.data());
    if (!serve.token_file.empty()) {
        auto token = service::read_token(serve.token_file);
        if (!token.ok()) return token.status();
        settings.guard.token = *token;
    } else if (!service::is_loopback(serve.bind)) {
        return Status(StatusCode::usage, "--bind " + serve.bind +
                                             " is reachable from other machines: add --token-file "
                                             "(create it with `openssl rand -hex 32 > FILE`)");
    }
    if (options.verbose) settings.log = [](const std::string& line) { log::detail(line); };
    return settings;
}

}  // namespace

void add_serve(CLI::App& subcommand, Options& options, ServeOptions& serve) {
    subcommand
        .add_option("--root", serve.roots,
                    "folder that must contain every path of a job, may be repeated; relative paths "
                    "start at the first")
        ->type_name("DIR")
        ->required()
        ->expected(1)
        ->take_all();
    subcommand
        .add_option("--store", serve.store,
                    "database of jobs (default: postchain/jobs.sqlite in "
                    "$XDG_STATE_HOME or ~/.local/state)")
        ->type_name("FILE");
    subcommand.add_option("--port", serve.port, "port to listen on; 0 = any free port")
        ->check(CLI::Range(0, 65535))
        ->capture_default_str();
    subcommand
        .add_option("--bind", serve.bind,
                    "address to listen on; any but 127.0.0.1 and ::1 needs --token-file")
        ->type_name("ADDRESS")
        ->capture_default_str();
    subcommand
        .add_option("--token-file", serve.token_file,
                    "file whose first line is the bearer token that every request must have")
        ->type_name("FILE");
    subcommand
        .add_option("--host", serve.hosts,
                    "host name by which clients reach this service, may be repeated")
        ->type_name("NAME")
        ->expected(1)
        ->take_all();
    subcommand
        .add_option("--attempts", serve.attempts, "attempts at a frame before it is quarantined")
        ->check(CLI::Range(1, 1000))
        ->capture_default_str();
    subcommand
        .add_option("--max-queue", serve.max_queue,
                    "maximum of waiting jobs; further jobs are refused")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
    subcommand
        .add_option("--max-connections", serve.max_connections,
                    "maximum of simultaneous connections")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    subcommand
        .add_option("--max-connections-per-address", serve.max_connections_per_address,
                    "maximum of simultaneous connections from one address")
        ->check(CLI::Range(1, 100000))
        ->capture_default_str();
    add_device(subcommand, options);
}

int serve_subcommand(const Options& options, const ServeOptions& serve) {
    auto settings = server_settings(options, serve);
    if (!settings.ok()) return fail(settings.status());
    auto roots = service::Roots::of(serve.roots);
    if (!roots.ok()) return fail(roots.status());
    auto store = store_of(serve);
    if (!store.ok()) return fail(store.status());
    allow_connections(serve.max_connections);

    const StopOnSignal stop;
    std::unique_ptr<service::Server> server;  // outlives the service, which may answer late
    service::ServiceSettings work;
    work.store = *store;
    work.roots = *roots;
    work.device = options.device;
    work.threads = options.threads;
    work.attempts = serve.attempts;
    work.max_queue = size_t(serve.max_queue);
    work.version = kVersion;
    work.log = [](const std::string& line) { log::error(line); };
    work.warn = [](const std::string& line) { log::warning(line); };
    auto opened = service::Service::open(work, builtin_passes());
    if (!opened.ok()) return fail(opened.status());
    {
        auto listening = service::Server::open(*settings, **opened);
        if (!listening.ok()) return fail(listening.status());
        server = std::move(*listening);
    }
    const std::string address = address_text(serve.bind, server->port());
    std::printf("%s\n", address.c_str());
    std::fflush(stdout);
    for (const auto& root : roots->folders()) log::info("root " + root);
    log::info("jobs are stored in " + *store);
    const service::Health health = (*opened)->health();
    log::info("filtering on " + health.renderer);
    if (settings->guard.token.empty())
        log::info("listening on " + address +
                  " for programs on this machine only, without a token");
    else
        log::info("listening on " + address + " for clients with the token of " + serve.token_file);
    if (!service::is_loopback(serve.bind))
        log::warning(
            "other machines can connect without encryption: on a shared network, "
            "put a TLS proxy in front");
    notify_system("READY=1");
    server->run(stop.flag());
    notify_system("STOPPING=1");
    log::info("stopped; unfinished jobs stay in the queue");
    opened->reset();
    return stop.exit_code();
}

}  // namespace postchain
