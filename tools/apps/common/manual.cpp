#include "tools/apps/common/manual.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "chain/base/text.h"
#include "chain/plan/plan.h"
#include "config/chain_find.h"
#include "config/schema.h"
#include "passes/registry.h"

namespace postchain {
namespace {

std::vector<const CLI::App*> subcommands(const CLI::App& app) {
    return app.get_subcommands([](const CLI::App*) { return true; });
}

// roff: a line must not start with a dot; backslashes and dashes must be escaped.
std::string roff(const std::string& text) {
    std::string out;
    for (char c : as_options(text))
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

// "postchain-lab" -> "_postchain_lab".
std::string function_of(const char* program) {
    std::string name = concat("_", program);
    std::ranges::replace(name, '-', '_');
    return name;
}

}  // namespace

std::string man_page(const Program& program, const CLI::App& app) {
    std::string title = program.name;
    std::ranges::transform(title, title.begin(), [](char c) { return char(std::toupper(c)); });
    std::string out = ".TH " + title + " 1 \"\" \"postchain " + std::string(kVersion) + "\"\n";
    out += concat(".SH NAME\n", roff(program.name), " \\- ", roff(app.get_description()),
                  "\n.SH SYNOPSIS\n");
    for (const CLI::App* subcommand : subcommands(app))
        out += ".B postchain " + roff(subcommand->get_name()) + "\n[\\fIoptions\\fR]\n.br\n";
    for (const CLI::App* subcommand : subcommands(app)) {
        out += ".SH " + roff(subcommand->get_name()) + "\n" + roff(subcommand->get_description()) +
               ".\n";
        for (const SubcommandRow& row : all_subcommands())
            if (row.name == subcommand->get_name() && row.part != program.part)
                out += ".PP\nSee\n.BR " + roff(row.part->program) + " (1).\n";
        for (const CLI::Option* option : subcommand->get_options())
            out += ".TP\n.B " + roff(names_of(*option)) + "\n" + roff(option->get_description()) +
                   "\n";
    }
    if (program.find("passes")) {
        out +=
            ".SH PARAMETERS\nParameters of passes and camera: keys of a chain file or of "
            "\\-\\-set.\n";
        for (const auto& type : builtin_passes().types())
            append_parameters(out, type.name, *type.parameters);
        append_parameters(out, "camera", camera_parameters());
    }
    out += ".SH EXIT STATUS\n" + roff(app.get_footer()) + "\n";
    return out;
}

std::string bash_completion(const Program& program, const CLI::App& app) {
    std::vector<std::string> names;
    for (const CLI::App* subcommand : subcommands(app)) names.push_back(subcommand->get_name());
    const std::string function = function_of(program.name);
    std::string out = concat(
        "# bash completion of postchain, made by `", program.name, " completion`\n", function,
        "() {\n"
        "    local current=${COMP_WORDS[COMP_CWORD]} previous=${COMP_WORDS[COMP_CWORD-1]}\n"
        "    local subcommand=${COMP_WORDS[1]}\n"
        "    if ((COMP_CWORD == 1)); then\n"
        "        COMPREPLY=($(compgen -W \"",
        joined(names, " "),
        " --help --version\" -- \"$current\"))\n"
        "        return\n"
        "    fi\n");
    // The script of a part is made when it is wanted first.
    out += "    case $subcommand in\n";
    for (const SubcommandRow& row : all_subcommands()) {
        if (!row.part || program.part) continue;
        const std::string of_part = function_of(row.part->program);
        out += concat("        ", row.name, ")\n            declare -F ", of_part,
                      " > /dev/null || source <(", row.part->program,
                      " completion 2> /dev/null)\n            declare -F ", of_part,
                      " > /dev/null && ", of_part, "\n            return ;;\n");
    }
    out += "    esac\n    case \"$subcommand $previous\" in\n";
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
        "        esac\n        return\n    fi\n    if ((COMP_CWORD == 2)); then\n"
        "        case $subcommand in\n";
    for (const Subcommand& one : program.subcommands)
        if (one.first_words)
            out += concat("        ", one.name, ") COMPREPLY=($(compgen -W \"",
                          joined(one.first_words(), " "), "\" -- \"$current\")) ;;\n");
    out += concat(
        "        esac\n    fi\n"
        "    COMPREPLY+=($(compgen -f -- \"$current\"))\n"
        "}\n"
        "complete -o nospace -o filenames -F ",
        function, " ", program.name, "\n");
    return out;
}

}  // namespace postchain
