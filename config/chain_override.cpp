#include "config/chain_override.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <set>

#include "config/camera_file.h"
#include "config/chain_file.h"
#include "config/reporter.h"
#include "config/scalar.h"
#include "config/text_check.h"
#include "config/text_tree.h"

namespace postchain {
namespace {

// The parts of "passes[0].samples=51".
struct Override {
    std::string source;  // "--set passes[0].samples=51"
    std::string target;  // "passes[0]", "motion_blur", "camera"
    std::string key;     // "samples"
    ParameterValue value;
};

class Overrider {
  public:
    Overrider(const PassEntries& entries, const PassRegistry& registry, Chain& chain,
              Diagnostics& out)
        : entries_(entries), registry_(registry), chain_(chain), out_(out) {}

    void apply(const std::vector<std::string>& texts) {
        std::vector<Override> all;
        for (const auto& text : texts)
            if (auto parsed = parse(text)) all.push_back(std::move(*parsed));
        for (const auto& item : all)
            if (item.target == "camera") set_camera(item);
        for (const auto& item : all)
            if (item.target != "camera") set_pass(item);
        warn_of_unread();
        // Checks across rows, once per changed pass, and for the camera.
        for (const auto& [link, item] : touched_) {
            if (link == kCamera) {
                if (Status status = camera_parameters().check(&chain_.camera); !status.ok())
                    report(item, Severity::error, "camera", status.message());
                continue;
            }
            const ChainLink& at = chain_.links[size_t(link)];
            if (Status status = at.type->parameters->check(at.pass->parameters()); !status.ok())
                report(item, Severity::error, path_of(link), status.message());
        }
    }

  private:
    void report(const Override& item, Severity severity, const std::string& path,
                const std::string& message) {
        Reporter(item.source, StatusCode::usage, out_).add(severity, 0, 0, path, message);
    }

    // Stated values that have no effect with the values of an override.
    void warn_of_unread() {
        if (has_errors(out_)) return;
        for (const auto& [link, item] : touched_) {
            if (link == kCamera) continue;
            const ChainLink& at = chain_.links[size_t(link)];
            for (const auto& row : at.type->parameters->rows()) {
                const std::string path = path_of(link) + "." + row.key;
                const auto stated = chain_.origins.find(path);
                if (stated == chain_.origins.end()) continue;
                const std::string text = at.type->parameters->unread(row, at.pass->parameters());
                if (text.empty()) continue;
                const auto& [from, where] = stated->second;
                Reporter(from == kFromOption ? where : item.source, StatusCode::usage, out_)
                    .add(Severity::warning, 0, 0, path,
                         from == kFromOption ? text : concat(text, " (given in ", where, ")"));
            }
        }
    }

    std::optional<Override> parse(const std::string& text) {
        Override item{"{set} "_keyed + text, {}, {}, {}};
        const auto refuse = [&](const std::string& message) {
            report(item, Severity::error, "", message);
            return std::nullopt;
        };
        // The value may be written into a chain file, which allows the same characters only.
        if (const auto bad = find_bad_character(text)) return refuse(bad->message);
        const size_t equals = text.find('=');
        const std::string path = text.substr(0, equals);
        const size_t dot = path.rfind('.');
        if (equals == std::string::npos || dot == std::string::npos || dot == 0 ||
            dot + 1 == path.size())
            return refuse(
                "an override reads PASS.KEY=VALUE, passes[N].KEY=VALUE or "
                "camera.KEY=VALUE");
        item.target = path.substr(0, dot);
        item.key = path.substr(dot + 1);
        const std::string word = text.substr(equals + 1);
        if (word.empty()) return refuse("no value after '='; write null to unset");
        const Result<ParameterValue> value = value_of_plain_text(word);
        if (!value.ok()) return refuse(value.status().message());
        item.value = *value;
        return item;
    }

    std::string path_of(int link) const {
        const auto found = std::find(entries_.begin(), entries_.end(), link);
        return concat("passes[", found - entries_.begin(), "]");
    }

    static bool exclude(const Parameter& a, const Parameter& b) {
        return a.excludes == b.key || b.excludes == a.key;
    }

    // A camera value given with --set also replaces the passes' own values of that name.
    void set_camera(const Override& item) {
        const Status status = camera_parameters().set(&chain_.camera, item.key, item.value);
        if (!status.ok())
            return report(item, Severity::error, "camera." + item.key, status.message());
        resolve_files(chain_.camera, "");
        state("camera." + item.key, item);
        given_.insert({kCamera, item.key});
        touched_.emplace(kCamera, item);
        if (item.value == ParameterValue()) return;
        const Parameter& own = *camera_parameters().find(item.key);
        for (const auto& row : camera_parameters().rows())
            if (exclude(own, row) && !given_.contains({kCamera, row.key}))
                unset(item, "camera", &chain_.camera, row);
        for (size_t i = 0; i < chain_.links.size(); ++i) {
            const ParameterTable& table = *chain_.links[i].type->parameters;
            const Parameter* same = table.find(item.key);
            for (const auto& row : table.rows())
                if (row.key == item.key || exclude(own, row) ||
                    (same && same->optional && exclude(*same, row)))
                    unset(item, int(i), row);
        }
    }

    void unset(const Override& item, int link, const Parameter& row) {
        unset(item, path_of(link), chain_.links[size_t(link)].pass->parameters(), row);
    }
    void unset(const Override& item, const std::string& path, ParameterRef parameters,
               const Parameter& row) {
        if (!row.optional || row.get(parameters) == ParameterValue()) return;
        report(item, Severity::note, path + "." + row.key,
               text_of(row.get(parameters)) + " of the chain file is dropped");
        row.set(parameters, ParameterValue());
        chain_.origins.erase(path + "." + row.key);
    }
    void state(const std::string& path, const Override& item) {
        if (item.value == ParameterValue())
            chain_.origins.erase(path);
        else
            chain_.origins[path] = {kFromOption, item.source};
    }

    // The link that an override names, or -1 after an error. A pass that could not be read has its
    // own error.
    int find_link(const Override& item) {
        const auto refuse = [&](const std::string& message) {
            report(item, Severity::error, item.target, message);
            return -1;
        };
        const std::string& target = item.target;
        if (target.starts_with("passes[") && target.ends_with(']')) {
            size_t index = 0;
            const char* from = target.data() + 7;
            const char* to = target.data() + target.size() - 1;
            const auto read = std::from_chars(from, to, index);
            if (read.ec != std::errc() || read.ptr != to)
                return refuse("expected the number of a pass, as in passes[0].samples=51");
            if (index >= entries_.size())
                return refuse(concat("the chain has ", entries_.size(),
                                     " passes, counted from 0; use a smaller number"));
            return entries_[index];
        }
        std::vector<int> found;
        std::vector<std::string> names = {"camera"};
        for (size_t i = 0; i < chain_.links.size(); ++i) {
            const std::string& name = chain_.links[i].type->name;
            if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
            if (name == target) found.push_back(int(i));
        }
        if (found.size() == 1) return found[0];
        if (found.size() > 1) {
            std::vector<std::string> paths;
            for (int link : found) paths.push_back(path_of(link));
            return refuse(target + " is in the chain more than once; use one of " + joined(paths));
        }
        const bool unread = std::count(entries_.begin(), entries_.end(), -1) > 0;
        if (unread) return -1;
        if (registry_.find(target))
            return refuse(target + " is not in the chain; use one of " + joined(names));
        return refuse("neither camera nor a pass of the chain; known are " + joined(names));
    }

    void set_pass(const Override& item) {
        const int link = find_link(item);
        if (link < 0) return;
        ChainLink& at = chain_.links[size_t(link)];
        const bool of_link = link_parameters().find(item.key);
        const ParameterTable& table = of_link ? link_parameters() : *at.type->parameters;
        const Status status =
            table.set(of_link ? ParameterRef(&at) : at.pass->parameters(), item.key, item.value);
        if (!status.ok())
            return report(item, Severity::error, path_of(link) + "." + item.key, status.message());
        if (of_link) return;
        // Values of the chain file that exclude this one are dropped. Two overrides that exclude
        // each other are an error.
        state(path_of(link) + "." + item.key, item);
        given_.insert({link, item.key});
        if (item.value != ParameterValue()) {
            const std::string& excluded = table.find(item.key)->excludes;
            for (const auto& row : table.rows())
                if ((row.excludes == item.key || row.key == excluded) &&
                    !given_.contains({link, row.key}))
                    unset(item, link, row);
        }
        touched_.emplace(link, item);
    }

    const PassEntries& entries_;
    const PassRegistry& registry_;
    Chain& chain_;
    Diagnostics& out_;
    static constexpr int kCamera = -1;  // instead of a link
    std::set<std::pair<int, std::string>> given_;
    std::map<int, Override> touched_;
};

}  // namespace

void apply_overrides(const std::vector<std::string>& overrides, const PassEntries& entries,
                     const PassRegistry& registry, Chain& chain, Diagnostics& diagnostics) {
    Overrider(entries, registry, chain, diagnostics).apply(overrides);
}

}  // namespace postchain
