// postchain man and completion: man page and bash completion, from the command's options and the
// parameter tables.
#include "tools/apps/postchain/subcommands.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>

#include "chain/base/text.h"
#include "chain/plan/plan.h"
#include "config/chain_find.h"
#include "config/schema.h"
#include "passes/registry.h"
#include "tools/apps/postchain/log.h"
#include "tools/measure/scenes/scene.h"

namespace postchain {
namespace {

std::vector<const CLI::App*> subcommands(const CLI::App& app) {
    return app.get_subcommands([](const CLI::App*) { return true; });
}

// roff: a line must not start with a dot; backslashes and dashes must be escaped.
std::string roff(const std::string& text) {
    std::string out;
    for (char c : text)
        if (c == '\\')
            out += "\\e";
        else if (c == '-')
            out += "\\-";
        else
            out += c;
    if (!out.empty() && (out[0] == '.' || out[0] == '\'')) out = "\\&" + out;
    return out;
}

std::string names_of(const CLI::Option& option) {
    std::string text = option.get_name(false, true);
    std::replace(text.begin(), text.end(), ',', ' ');
    const std::string type = option.get_type_name();
    return option.get_expected_max() > 0 && !type.empty() ? text + " " + type : text;
}

// The words of a choice, parsed from CLI11's "{fp16,fp32}".
std::vector<std::string> choices_of(const CLI::Option& option) {
    const std::string type = option.get_type_name();
    const size_t begin = type.find('{'), end = type.find('}');
    std::vector<std::string> words;
    if (begin == std::string::npos || end == std::string::npos) return words;
    std::string word;
    for (char c : type.substr(begin + 1, end - begin - 1) + ",") {
        if (c != ',') {
            word += c;
            continue;
        }
        words.push_back(word);
        word.clear();
    }
    return words;
}

std::vector<std::string> set_keys() {
    std::vector<std::string> keys;
    for (const auto& type : builtin_passes().types())
        for (const auto& row : type.parameters->rows()) keys.push_back(type.name + "." + row.key);
    for (const auto& row : camera_parameters().rows()) keys.push_back("camera." + row.key);
    return keys;
}

void append_parameters(std::string& out, const std::string& prefix, const ParameterTable& table) {
    for (const auto& row : table.rows()) {
        out += ".TP\n.B " + roff(prefix + "." + row.key) + "\n" + roff(row.help) + ": " +
               roff(row.domain());
        if (!row.unit.empty()) out += " (" + roff(row.unit) + ")";
        out += row.optional ? "; unset means " + roff(row.unset_means) + ".\n"
                            : "; default " + roff(text_of(row.default_value)) + ".\n";
    }
}

std::string man_page(const CLI::App& app) {
    std::string out = ".TH POSTCHAIN 1 \"\" \"postchain " + std::string(kVersion) + "\"\n";
    out += ".SH NAME\npostchain \\- " + roff(app.get_description()) + "\n.SH SYNOPSIS\n";
    for (const CLI::App* subcommand : subcommands(app))
        out += ".B postchain " + roff(subcommand->get_name()) + "\n[\\fIoptions\\fR]\n.br\n";
    for (const CLI::App* subcommand : subcommands(app)) {
        out += ".SH " + roff(subcommand->get_name()) + "\n" + roff(subcommand->get_description()) +
               ".\n";
        for (const CLI::Option* option : subcommand->get_options())
            out += ".TP\n.B " + roff(names_of(*option)) + "\n" + roff(option->get_description()) +
                   "\n";
    }
    out +=
        ".SH PARAMETERS\nParameters of passes and camera: keys of a chain file or of \\-\\-set.\n";
    for (const auto& type : builtin_passes().types())
        append_parameters(out, type.name, *type.parameters);
    append_parameters(out, "camera", camera_parameters());
    out += ".SH EXIT STATUS\n" + roff(app.get_footer()) + "\n";
    return out;
}

std::string bash_completion(const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* subcommand : subcommands(app)) names.push_back(subcommand->get_name());
    std::vector<std::string> scene_names;
    for (const auto& scene : scenes::scenes()) scene_names.push_back(scene.name);
    std::string out =
        "# bash completion of postchain, made by `postchain completion`\n"
        "_postchain() {\n"
        "    local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}\n"
        "    local subcommand=${COMP_WORDS[1]}\n"
        "    if ((COMP_CWORD == 1)); then\n"
        "        COMPREPLY=($(compgen -W \"" +
        joined(names, " ") +
        " --help --version\" -- \"$current\"))\n"
        "        return\n"
        "    fi\n"
        "    case \"$subcommand $previous\" in\n";
    for (const CLI::App* subcommand : subcommands(app)) {
        for (const CLI::Option* option : subcommand->get_options()) {
            auto words = choices_of(*option);
            if (option->get_name(false, true) == "--set")
                for (const auto& key : set_keys()) words.push_back(key + "=");
            else if (option->get_name(false, true) == "--profile")
                for (const auto& profile : builtin_profiles()) words.push_back(profile.name);
            if (words.empty()) continue;
            for (const auto& name : option->get_lnames())
                out += "    \"" + subcommand->get_name() + " --" + name +
                       "\")\n        COMPREPLY=($(compgen -W \"" + joined(words, " ") +
                       "\" -- \"$current\"))\n        return ;;\n";
        }
    }
    out += "    esac\n    if [[ $current == -* ]]; then\n        case $subcommand in\n";
    for (const CLI::App* subcommand : subcommands(app)) {
        std::vector<std::string> flags;
        for (const CLI::Option* option : subcommand->get_options())
            for (const auto& name : option->get_lnames()) flags.push_back("--" + name);
        out += "        " + subcommand->get_name() + ") COMPREPLY=($(compgen -W \"" +
               joined(flags, " ") + "\" -- \"$current\")) ;;\n";
    }
    out +=
        "        esac\n        return\n    fi\n"
        "    if ((COMP_CWORD == 2)) && [[ $subcommand == scene ]]; then\n"
        "        COMPREPLY=($(compgen -W \"" +
        joined(scene_names, " ") +
        "\" -- \"$current\"))\n"
        "        return\n    fi\n"
        "    if ((COMP_CWORD == 2)) && [[ $subcommand == run || $subcommand == plan ]]; then\n"
        "        COMPREPLY=($(compgen -W \"" +
        joined(shipped_chains(), " ") +
        "\" -- \"$current\") $(compgen -f -- \"$current\"))\n"
        "        return\n    fi\n"
        "    COMPREPLY=($(compgen -f -- \"$current\"))\n"
        "}\n"
        "complete -o nospace -o filenames -F _postchain postchain\n";
    return out;
}

RunSubcommand print(const CLI::App& subcommand, std::string (*text_of)(const CLI::App&)) {
    return [&subcommand, text_of] {
        std::fputs(text_of(*subcommand.get_parent()).c_str(), stdout);
        return kExitOk;
    };
}

}  // namespace

RunSubcommand add_man(CLI::App& subcommand, Options&) {
    return print(subcommand, man_page);
}

RunSubcommand add_completion(CLI::App& subcommand, Options&) {
    return print(subcommand, bash_completion);
}

}  // namespace postchain
