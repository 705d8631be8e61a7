// postchain-serve: jobs over HTTP (docs/service.md).
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <memory>
#include <thread>

#include "config/reporter.h"
#include "config/scalar.h"
#include "passes/registry.h"
#include "tools/apps/common/confine.h"
#include "tools/apps/common/log.h"
#include "tools/apps/common/program.h"
#include "tools/apps/common/stop_on_signal.h"
#include "tools/sequence/files/atomic_file.h"
#include "tools/service/http/server.h"
#include "tools/service/store/store_file.h"
#include "tools/service/work/job_runner.h"
#include "tools/service/work/service.h"
#include "tools/service/work/slurm_queue.h"

namespace postchain {
namespace {

enum class ServeBackend { local, slurm };

struct ServeOptions {
    std::string config;
    std::vector<std::string> roots;
    std::string store;  // empty = in the state folder of the user or system
    int port = 8080;
    std::string bind = "127.0.0.1";
    std::string users;
    std::string user_header;
    std::vector<std::string> trusted;  // proxies
    double frame_timeout_s = 1800;
    double slice_s = 60;
    int keep_jobs = 1000;
    int keep_days = 0;
    std::string backup;
    std::string hash_token;
    ServeBackend backend = ServeBackend::local;
    std::string farm_folder;
    std::string farm_program;
    std::string farm_memory;
    int farm_frames = 8;
    int farm_cpus = 2;
    int farm_nice = 10;
    int farm_jobs = 16;
    int farm_jobs_per_user = 4;
    int farm_tasks = 0;
    int farm_lag_s = 30;
    std::vector<std::string> slurm_words;
    std::vector<std::string> hosts;
    int attempts = 3;
    int max_queue = 1000;
    int max_connections = 4096;
    int max_connections_per_address = 2048;
};

// Options that are no settings of a service.
bool is_action(const std::string& key) {
    return key == "config" || key == "backup" || key == "hash_token";
}

constexpr int kOtherFiles = 256;  // open files other than connections

RowOptions text_row(const char* form, const char* help) {
    return {.unit = form, .help = help};
}

RowOptions number_row(double min, double max, const char* help) {
    return {.min = min, .max = max, .help = help};
}

// Without the options that may be repeated, which add_serve() adds.
const ParameterTable& serve_parameters() {
    using O = ServeOptions;
    static const ParameterTable table =
        ParameterTableBuilder<O>()
            .text("config", &O::config,
                  text_row("FILE",
                           "YAML file of these options; those of the command line come first"))
            .text("store", &O::store,
                  text_row("FILE",
                           "database of jobs (default: postchain/jobs.sqlite in "
                           "$XDG_STATE_HOME or ~/.local/state)"))
            .integer("port", &O::port, number_row(0, 65535, "port to listen on; 0 = any free port"))
            .text("bind", &O::bind,
                  text_row("ADDRESS",
                           "address to listen on; any but 127.0.0.1 and ::1 needs --users"))
            .text("users", &O::users,
                  text_row("FILE",
                           "file of users, with their hashes of tokens, folders and limits; SIGHUP "
                           "reads it again"))
            .text("user_header", &O::user_header,
                  text_row("NAME",
                           "header in which a trusted proxy names the user who has logged in, such "
                           "as X-Remote-User"))
            .text("hash_token", &O::hash_token,
                  text_row("FILE",
                           "print the hash of the token in the first line of this file and end; - "
                           "reads the standard input"))
            .number(
                "frame_timeout", &O::frame_timeout_s,
                number_row(0, 86400,
                           "seconds that a job's process may print nothing, then it is killed and "
                           "its frame has failed an attempt; 0 = no limit"))
            .number(
                "slice", &O::slice_s,
                number_row(0, 86400,
                           "seconds until a job makes way for another user's of the same priority"))
            .integer("keep_jobs", &O::keep_jobs,
                     number_row(1, 1000000, "maximum of ended jobs that the store keeps"))
            .integer("keep_days", &O::keep_days,
                     number_row(0, 36500, "days that the store keeps ended jobs; 0 = no limit"))
            .text("backup", &O::backup,
                  text_row(
                      "FILE",
                      "copy the store to this file and end; also while a service uses the store"))
            .integer("attempts", &O::attempts,
                     number_row(1, 1000, "attempts at a frame before it is quarantined"))
            .integer("max_queue", &O::max_queue,
                     number_row(1, 1000000, "maximum of waiting jobs; further jobs are refused"))
            .integer("max_connections", &O::max_connections,
                     number_row(1, 100000, "maximum of simultaneous connections"))
            .integer("max_connections_per_address", &O::max_connections_per_address,
                     number_row(1, 100000, "maximum of simultaneous connections from one address"))
            .choice("backend", &O::backend, {"local", "slurm"},
                    {.help = "where jobs run: on this machine, or as arrays of Slurm"})
            .table();
    return table;
}

// The options that may be repeated, by their keys in --config.
struct ServeList {
    const char *key, *option;
    std::vector<std::string> ServeOptions::*words;
};
constexpr std::array kServeLists = {
    ServeList{"roots", "--root", &ServeOptions::roots},
    ServeList{"trusted_proxies", "--trusted-proxy", &ServeOptions::trusted},
    ServeList{"hosts", "--host", &ServeOptions::hosts},
    ServeList{"slurm_options", "--slurm-option", &ServeOptions::slurm_words},
};

// Options of --backend slurm.
const ParameterTable& slurm_parameters() {
    using O = ServeOptions;
    static const ParameterTable table =
        ParameterTableBuilder<O>()
            .text("farm_folder", &O::farm_folder,
                  text_row("DIR",
                           "folder for chains and messages of tasks, which the other machines see "
                           "too; outside of the roots, of this user, mode 0700"))
            .text("farm_program", &O::farm_program,
                  text_row("FILE", "postchain on the other machines (default: from their PATH)"))
            .text("farm_memory", &O::farm_memory,
                  text_row("SIZE", "memory of a task, such as 8G (default: the queue's)"))
            .integer("farm_frames", &O::farm_frames, number_row(1, 100000, "frames of a task"))
            .integer("farm_cpus", &O::farm_cpus, number_row(1, 1024, "CPUs and threads of a task"))
            .integer("farm_nice", &O::farm_nice,
                     number_row(1, 10000,
                                "Slurm's nice for each step that a job's priority is below 100"))
            .integer("farm_jobs", &O::farm_jobs,
                     number_row(1, 10000, "maximum of jobs in Slurm; others wait in the service"))
            .integer("farm_jobs_per_user", &O::farm_jobs_per_user,
                     number_row(1, 10000, "maximum of jobs in Slurm of one user"))
            .integer("farm_tasks", &O::farm_tasks,
                     number_row(0, 1000000,
                                "maximum of tasks that run at a time, shared equally by users and "
                                "their jobs; 0 = no limit"))
            .integer("farm_lag", &O::farm_lag_s,
                     number_row(0, 3600,
                                "seconds until this machine sees what an ended task wrote, as NFS "
                                "needs"))
            .table();
    return table;
}

// The value of a key of --config into the options. Errors (usage, chain): an unknown key, a value
// of another type or out of range.
Status set_key(const std::string& key, const TextNode& value, ServeOptions& serve,
               Options& options) {
    std::vector<std::string> known = {"postchain_service", "device", "threads"};
    for (const ServeList& list : kServeLists) {
        known.emplace_back(list.key);
        if (key != list.key) continue;
        if (!value.is_list()) return Status(StatusCode::usage, "expected a list");
        (serve.*list.words).clear();
        for (const TextNode& item : value.items) {
            if (!item.is_scalar()) return Status(StatusCode::usage, "expected a list of strings");
            (serve.*list.words).push_back(item.text);
        }
        return Status();
    }
    if (key == "device") {
        if (!value.is_scalar()) return Status(StatusCode::usage, "expected a string");
        options.device = value.text;
        return Status();
    }
    if (key == "threads") {
        ASSIGN_OR_RETURN(options.threads, integer_of(value, 1, 1024));
        return Status();
    }
    for (const ParameterTable* table : {&serve_parameters(), &slurm_parameters()}) {
        for (const Parameter& row : table->rows())
            if (!is_action(row.key)) known.push_back(row.key);
        const Parameter* row = table->find(key);
        if (row && !is_action(key)) return set_row(*table, &serve, *row, value);
    }
    return Status(StatusCode::usage, unknown_word("key", key, known));
}

// Reads --config. Options of the command line stay.
Status read_config(const CLI::App& subcommand, ServeOptions& serve, Options& options) {
    const std::string& path = serve.config;
    ASSIGN_OR_RETURN(const auto text, read_text_file(path, StatusCode::usage));
    const TextTree tree = read_text_tree(text, path, StatusCode::usage);
    Diagnostics faults = tree.diagnostics;
    Reporter reporter(path, StatusCode::usage, faults);
    if (!has_errors(faults)) {
        const TextNode* version = tree.root.find("postchain_service");
        if (version)
            reporter.check_version(*version, "postchain_service", 1);
        else
            reporter.error(tree.root, "", "expected postchain_service: 1");
        for (const auto& [key, value] : tree.root.entries) {
            if (key.text == "postchain_service") continue;
            std::string option = option_name(key.text);
            for (const ServeList& list : kServeLists)
                if (key.text == list.key) option = list.option;
            const CLI::Option* given = subcommand.get_option_no_throw(option);
            if (given && given->count() > 0 && !is_action(key.text)) continue;
            if (const Status status = set_key(key.text, value, serve, options); !status.ok())
                reporter.error(value, key.text, status.message());
        }
    }
    return log::write(faults, log::Level::info);
}

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

Result<std::shared_ptr<service::Users>> users_of(const ServeOptions& serve,
                                                 const service::Roots& roots) {
    if (serve.users.empty()) return std::make_shared<service::Users>();
    return service::Users::of_file(serve.users, [roots](const std::string& folder) {
        return roots.within({folder}).status();
    });
}

// The queue and how jobs are handed to it; none for this machine.
struct FarmSettings {
    std::shared_ptr<service::TaskQueue> queue;
    service::QueueSettings settings;
};
Result<FarmSettings> farm_settings(const Options& options, const ServeOptions& serve,
                                   const service::Roots& roots) {
    FarmSettings farm;
    if (serve.backend == ServeBackend::local) {
        std::vector<std::string> given;
        for (const Parameter& row : slurm_parameters().rows())
            if (row.get(&serve) != row.default_value) given.push_back(row.key);
        if (!serve.slurm_words.empty()) given.emplace_back("slurm_option");
        if (!given.empty())
            return Status(StatusCode::usage,
                          option_name(given.front()) + " has no effect; add --backend slurm");
        return farm;
    }
    if (serve.farm_folder.empty())
        return Status(StatusCode::usage,
                      "--backend slurm: add --farm-folder, a folder outside of the roots that "
                      "every machine of Slurm sees");
    RETURN_IF_ERROR(
        service::take_private_folder(serve.farm_folder, roots.folders()).at("--farm-folder"));
    farm.queue = std::make_shared<service::SlurmQueue>(service::SlurmSettings{
        serve.slurm_words, serve.farm_memory, serve.farm_cpus, serve.farm_nice, kVersion});
    service::QueueSettings& settings = farm.settings;
    settings.folder = std::filesystem::absolute(serve.farm_folder);
    if (!serve.farm_program.empty()) settings.program = serve.farm_program;
    settings.device = options.device;
    settings.frames_per_task = serve.farm_frames;
    settings.max_jobs = serve.farm_jobs;
    settings.max_jobs_of_user = serve.farm_jobs_per_user;
    settings.max_tasks = serve.farm_tasks;
    settings.lag = std::chrono::seconds(serve.farm_lag_s);
    return farm;
}

// A program that is installed beside this one.
std::string beside_this(const char* name) {
    std::error_code error;
    const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
    return (self.parent_path() / name).string();
}

// Compiled programs are kept beside the store, for the processes of jobs and previews alone, unless
// $MESA_SHADER_CACHE_DIR names a folder.
void keep_programs_beside(const std::string& store) {
    if (std::getenv("MESA_SHADER_CACHE_DIR")) return;
    const auto path = std::filesystem::absolute(store);
    const std::string folder =
        (path.parent_path() / ("." + path.filename().string() + ".programs")).string();
    std::error_code error;
    std::filesystem::create_directory(folder, error);
    ::setenv("MESA_SHADER_CACHE_DIR", folder.c_str(), 1);
    ::setenv("MESA_SHADER_CACHE_MAX_SIZE", "256M", 1);
}

// Sends a state such as "READY=1" to the service manager, at the socket named by $NOTIFY_SOCKET:
// sd_notify(3) without its library.
void notify_system(const std::string& state) {
    const char* name = std::getenv("NOTIFY_SOCKET");
    sockaddr_un address = {};
    if (!name || (name[0] != '/' && name[0] != '@')) return;
    const size_t length = std::strlen(name);
    if (length >= sizeof(address.sun_path)) return;
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, name, length);
    if (name[0] == '@') address.sun_path[0] = '\0';  // abstract namespace
    const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return;
    sendto(fd, state.data(), state.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
           reinterpret_cast<sockaddr*>(&address),
           socklen_t(offsetof(sockaddr_un, sun_path) + length));
    close(fd);
}

// Follows SIGHUP, and tells the service manager that the service lives, until it is destroyed.
class Keeper {
  public:
    Keeper(service::Service& service, service::Server& server, service::Users& users)
        : service_(service), server_(server), users_(users), thread_([this] { loop(); }) {}
    ~Keeper() {
        ends_ = true;
        thread_.join();
    }
    Keeper(const Keeper&) = delete;
    Keeper& operator=(const Keeper&) = delete;

  private:
    using Clock = std::chrono::steady_clock;
    static constexpr std::chrono::milliseconds kTick{100};

    void loop() {
        const char* text = std::getenv("WATCHDOG_USEC");
        const std::chrono::microseconds every(text ? std::atoll(text) / 2 : 0);
        auto last = Clock::now();
        uint64_t beats = 0;
        while (!ends_) {
            try {
                std::this_thread::sleep_for(kTick);
                if (StopOnSignal::asked_to_reload()) reload();
                if (every.count() <= 0 || Clock::now() - last < every) continue;
                last = Clock::now();
                // Silence makes the service manager start the service anew.
                const uint64_t now = server_.beats();
                if (now != beats && service_.alive() && server_.alive())
                    notify_system("WATCHDOG=1");
                beats = now;
            } catch (...) {
                // Out of memory. If it stays so, there is silence.
            }
        }
    }

    void reload() {
        const Status status = users_.reload();
        if (status.ok())
            log::write_event(log::Level::info, concat("users read again: ", users_.count()),
                             {{"event", "reload"}});
        else
            log::write_event(log::Level::error, concat(status.message(), "; the former users stay"),
                             {{"event", "reload"}});
    }

    service::Service& service_;
    service::Server& server_;
    service::Users& users_;
    std::atomic<bool> ends_ = false;
    std::thread thread_;
};

void write_line(const service::LogLine& line) {
    const auto level = line.level == service::LogLine::Level::info      ? log::Level::info
                       : line.level == service::LogLine::Level::warning ? log::Level::warning
                                                                        : log::Level::error;
    log::write_event(level, line.message, line.fields);
}

Result<int> print_hash(const std::string& path) {
    std::ifstream file;
    if (path != "-") file.open(path);
    if (path != "-" && !file)
        return Status(StatusCode::usage, "--hash-token: " + path + ": cannot be read");
    std::string token;
    std::getline(path == "-" ? std::cin : file, token);
    while (token.ends_with('\r')) token.pop_back();
    ASSIGN_OR_RETURN(const auto hash, service::hash_of_token(token).at("--hash-token"));
    std::printf("%s\n", hash.c_str());
    return kExitOk;
}

Result<service::ServerSettings> server_settings(const Options& options, const ServeOptions& serve,
                                                const std::shared_ptr<service::Users>& users) {
    service::ServerSettings settings;
    settings.address = serve.bind;
    settings.port = uint16_t(serve.port);
    settings.version = kVersion;
    settings.max_connections = size_t(serve.max_connections);
    settings.max_connections_per_address = size_t(serve.max_connections_per_address);
    for (const std::string& host : serve.hosts)
        if (host.empty() || host.find_first_of("/:[] ") != std::string::npos)
            return Status(StatusCode::usage, concat("--host: '", host,
                                                    "' is not the name of a host; expected a form "
                                                    "like farm.example"));
    settings.guard.hosts = serve.hosts;
    for (const std::string& text : serve.trusted) {
        ASSIGN_OR_RETURN(const auto network, service::Network::parse(text).at("--trusted-proxy"));
        settings.guard.trusted.push_back(network);
    }
    std::array<char, 256> name = {};
    if (gethostname(name.data(), name.size() - 1) == 0)
        settings.guard.hosts.emplace_back(name.data());
    if (users->are_everyone() && !service::is_loopback(serve.bind))
        return Status(StatusCode::usage,
                      "--bind " + serve.bind + " is reachable from other machines: add --users");
    if (users->are_everyone() && !serve.trusted.empty())
        return Status(StatusCode::usage,
                      "--trusted-proxy: other machines reach the service through the proxy: add "
                      "--users");
    if (!serve.user_header.empty() && serve.trusted.empty())
        return Status(StatusCode::usage,
                      "--user-header: add --trusted-proxy, whose header is believed");
    settings.guard.user_header = serve.user_header;
    settings.guard.users = users;
    settings.audit = write_line;
    if (options.verbose) settings.log = [](const std::string& line) { log::detail(line); };
    return settings;
}

Result<int> run_service(const Options& options, const ServeOptions& serve) {
    if (!serve.hash_token.empty()) return print_hash(serve.hash_token);
    ASSIGN_OR_RETURN(const auto store, store_of(serve));
    if (!serve.backup.empty()) {
        RETURN_IF_ERROR(service::back_up(store, serve.backup));
        log::info(store + " is copied to " + serve.backup);
        return kExitOk;
    }
    ASSIGN_OR_RETURN(const auto roots, service::Roots::of(serve.roots));
    ASSIGN_OR_RETURN(const auto users, users_of(serve, roots));
    ASSIGN_OR_RETURN(const auto settings, server_settings(options, serve, users));
    ASSIGN_OR_RETURN(const auto farm, farm_settings(options, serve, roots));
    keep_programs_beside(store);
    allow_connections(serve.max_connections);

    const StopOnSignal stop(true);
    std::unique_ptr<service::Server> server;  // outlives the service, which may answer late
    service::ServiceSettings work;
    work.store = store;
    work.roots = roots;
    work.device = options.device;
    work.threads = options.threads;
    work.attempts = serve.attempts;
    work.max_queue = size_t(serve.max_queue);
    work.users = users;
    work.program = beside_this("postchain");
    work.preview_program = beside_this("postchain-preview");
    work.frame_timeout_s = serve.frame_timeout_s;
    work.slice_s = serve.slice_s;
    work.keep = {serve.keep_jobs, serve.keep_days};
    work.queue = farm.queue;
    work.remote = farm.settings;
    work.version = kVersion;
    work.less_confined = confinement();
    work.log = write_line;
    ASSIGN_OR_RETURN(auto opened, service::Service::open(work, builtin_passes()));
    ASSIGN_OR_RETURN(server, service::Server::open(settings, *opened));
    const std::string address = address_text(serve.bind, server->port());
    std::printf("%s\n", address.c_str());
    std::fflush(stdout);
    for (const auto& root : roots.folders()) log::info("root " + root);
    log::info("jobs are stored in " + store);
    const service::Health health = opened->health();
    log::info("filtering on " + health.renderer);
    if (users->are_everyone())
        log::info("listening on " + address +
                  " for programs on this machine only, without a token");
    else
        log::info(concat("listening on ", address, " for ", users->count(),
                         users->count() == 1 ? " user of " : " users of ", serve.users));
    if (!work.less_confined.empty()) log::warning(work.less_confined);
    if (!service::is_loopback(serve.bind) && serve.trusted.empty())
        log::warning(
            "other machines can connect without encryption: on a shared network, "
            "put a TLS proxy in front");
    notify_system("READY=1");
    size_t lost = 0;
    {
        const Keeper keeper(*opened, *server, *users);
        lost = server->run(stop.flag());
    }
    notify_system("STOPPING=1");
    lost += opened->end();
    log::info("stopped; unfinished jobs stay in the queue");
    if (lost > 0) {
        // Waiting for them would wait for a disk that does not answer.
        log::warning(concat(lost == 1 ? "1 thread hangs" : concat(lost, " threads hang"),
                            " in a disk or a device and ", lost == 1 ? "is" : "are", " left"));
        io::remove_live_temporaries();
        std::fflush(nullptr);
        _exit(stop.exit_code());
    }
    opened.reset();
    return stop.exit_code();
}

RunSubcommand add_serve(CLI::App& subcommand, Options& options) {
    const auto held = std::make_shared<ServeOptions>();
    ServeOptions& serve = *held;
    add_list(subcommand, "--root", "DIR", serve.roots,
             "folder that must contain every path of a job, may be repeated; relative paths "
             "start at the first");
    add_settings(subcommand, serve_parameters(), "", &serve);
    add_list(subcommand, "--trusted-proxy", "ADDRESS[/BITS]", serve.trusted,
             "address or network of a proxy whose X-Forwarded-For and --user-header are believed, "
             "may be repeated");
    add_list(subcommand, "--host", "NAME", serve.hosts,
             "host name by which clients reach this service, may be repeated");
    add_settings(subcommand, slurm_parameters(), "", &serve);
    add_list(subcommand, "--slurm-option", "WORD", serve.slurm_words,
             "further option of sbatch, such as --partition=farm, may be repeated; {user} becomes "
             "the name of the job's owner");
    add_device(subcommand, options);
    return [&options, &subcommand, held]() -> Result<int> {
        if (!held->config.empty()) RETURN_IF_ERROR(read_config(subcommand, *held, options));
        return run_service(options, *held);
    };
}

}  // namespace
}  // namespace postchain

int main(int argc, char** argv) {
    using namespace postchain;
    const Subcommand subcommands[] = {{"serve", add_serve}};
    return run_program(
        {"postchain-serve", "Accepts jobs of postchain over HTTP.", &kServe, subcommands, "serve"},
        argc, argv);
}
