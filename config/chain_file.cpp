#include "config/chain_file.h"

#include "config/camera_file.h"
#include "config/chain_override.h"
#include "config/reporter.h"
#include "config/scalar.h"

namespace postchain {
namespace {

class ChainParser {
  public:
    ChainParser(const PassRegistry& registry, ChainFile& file)
        : registry_(registry),
          chain_(file.chain),
          file_name_(file.file_name),
          reporter_(file.file_name, StatusCode::chain, file.diagnostics) {}

    PassEntries entries;

    void parse(const TextNode& root) {
        if (!root.is_map())
            return reporter_.error(root, "",
                                   "a chain file is a map with the keys postchain, camera and "
                                   "passes, not " +
                                       root.describe());
        for (const auto& [key, value] : root.entries) {
            if (key.text == "postchain")
                reporter_.check_version(value, "postchain", kChainFileVersion);
            else if (key.text == "camera")
                camera(value);
            else if (key.text == "passes")
                passes(value);
            else
                reporter_.error(key, key.text,
                                unknown_word("key", key.text, {"postchain", "camera", "passes"}));
        }
        if (!root.find("postchain"))
            reporter_.error(
                root, "postchain",
                concat("missing; a chain file begins with postchain: ", kChainFileVersion));
        if (!root.find("passes"))
            reporter_.error(root, "passes", "missing; write passes: [] for a chain without passes");
    }

  private:
    void camera(const TextNode& node) {
        if (!node.is_map())
            return reporter_.error(node, "camera",
                                   node.describe() + "; camera is a map of camera values");
        rows(node, "camera", camera_parameters(), &chain_.camera);
        resolve_files(chain_.camera, file_name_);
    }

    void passes(const TextNode& node) {
        if (!node.is_list())
            return reporter_.error(node, "passes",
                                   node.describe() +
                                       "; passes is a list (write [] for a chain "
                                       "without passes)");
        if (node.items.size() > kMaxPasses)
            return reporter_.error(node.items[kMaxPasses], "passes",
                                   concat(node.items.size(), " passes; a chain has at most ",
                                          kMaxPasses, "; run the rest as a second chain"));
        for (size_t i = 0; i < node.items.size(); ++i)
            entries.push_back(pass(node.items[i], concat("passes[", i, "]")));
    }

    // Returns the index of the new link, or -1.
    int pass(const TextNode& node, const std::string& path) {
        const auto refuse = [&](const TextNode& at, const std::string& message) {
            reporter_.error(at, path, message);
            return -1;
        };
        const TextNode* name = &node;
        const TextNode* parameters = nullptr;
        if (node.is_map()) {
            if (node.entries.empty()) return refuse(node, "empty; name a pass");
            if (node.entries.size() > 1) {
                std::vector<std::string> keys;
                for (const auto& entry : node.entries) keys.push_back(entry.key.text);
                return refuse(node.entries[1].key,
                              "one entry of the list is one pass, but this one has " +
                                  joined(keys) +
                                  "; the parameters of a pass are a map, indented "
                                  "further or in { }");
            }
            name = &node.entries[0].key;
            parameters = &node.entries[0].value;
        } else if (!node.is_scalar()) {
            return refuse(node, node.describe() + "; an entry is NAME or NAME: {parameters}");
        }
        const PassType* type = registry_.find(name->text);
        if (!type) {
            std::vector<std::string> known;
            for (const auto& t : registry_.types()) known.push_back(t.name);
            return refuse(*name, unknown_word("pass", name->text, known));
        }
        Pass* made = chain_.append(registry_, type->name);
        if (parameters && !parameters->is_null()) {
            if (!parameters->is_map())
                refuse(*parameters,
                       parameters->describe() + "; the parameters of a pass are a map");
            else
                rows(*parameters, path, *type->parameters, made->parameters(),
                     &chain_.links.back());
        }
        return int(chain_.links.size()) - 1;
    }

    // Reads a map of values into the struct of a table. With `link` also the link's own rows.
    void rows(const TextNode& node, const std::string& path, const ParameterTable& own,
              ParameterRef of_own, ChainLink* link = nullptr) {
        bool good = true;
        std::vector<std::pair<const Parameter*, const TextNode*>> stated;  // with a value
        for (const auto& [key, value] : node.entries) {
            const std::string at = path + "." + key.text;
            const bool of_link = link && link_parameters().find(key.text);
            const ParameterTable& table = of_link ? link_parameters() : own;
            const ParameterRef parameters = of_link ? ParameterRef(link) : of_own;
            const Parameter* row = table.find(key.text);
            const Status status = row ? set_row(table, parameters, *row, value)
                                      : table.set(parameters, key.text, ParameterValue());
            if (!status.ok()) reporter_.error(row ? value : key, at, status.message());
            good = good && status.ok();
            if (!status.ok() || *value_of(value) == ParameterValue()) continue;
            chain_.origins[at] = {kFromChain, concat(file_name_, ":", key.line)};
            if (!of_link) stated.emplace_back(row, &key);
        }
        if (!good) return;
        if (Status status = own.check(of_own); !status.ok())
            reporter_.error(node, path, status.message());
        for (const auto& [row, key] : stated)
            if (const std::string text = own.unread(*row, of_own); !text.empty())
                reporter_.error(*key, path + "." + key->text, text);
    }

    const PassRegistry& registry_;
    Chain& chain_;
    const std::string& file_name_;
    Reporter reporter_;
};

std::string write_rows(const ParameterTable& table, ConstParameterRef parameters,
                       const std::string& indent) {
    std::string text;
    for (const auto& row : table.rows()) {
        const ParameterValue value = row.get(parameters);
        const bool unset = std::holds_alternative<std::monostate>(value);
        if (unset && value == row.default_value) continue;
        if (!table.unread(row, parameters).empty()) continue;
        text += indent + row.key + ": " + yaml_text_of(value) + "\n";
    }
    return text;
}

std::vector<Status> matte_faults(const PassEntries& entries, const Chain& chain) {
    std::vector<Status> faults;
    for (const int link : entries)
        faults.push_back(link < 0 ? Status() : chain.links[size_t(link)].check_matte());
    return faults;
}

// Checks the links after all overrides. `in_file`: the faults before them.
void check_mattes(const PassEntries& entries, const std::vector<Status>& in_file, ChainFile& file) {
    const std::vector<Status> faults = matte_faults(entries, file.chain);
    for (size_t i = 0; i < faults.size(); ++i) {
        if (faults[i].ok()) continue;
        Reporter reporter(in_file[i].ok() ? "{set}"_keyed : file.file_name,
                          in_file[i].ok() ? StatusCode::usage : StatusCode::chain,
                          file.diagnostics);
        reporter.add(Severity::error, 0, 0, concat("passes[", i, "].matte_effect"),
                     faults[i].message());
    }
}

// Calls `read` for the tree of a chain file; an error if memory runs out.
template <class ReadTree>
ChainFile parse_tree(const ReadTree& read, const std::string& file_name,
                     const PassRegistry& registry, const std::vector<std::string>& overrides) {
    ChainFile file;
    file.file_name = file_name;
    try {
        TextTree tree = read();
        file.diagnostics = std::move(tree.diagnostics);
        if (tree.root.is_null()) return file;
        ChainParser parser(registry, file);
        parser.parse(tree.root);
        sort_by_place(file.diagnostics);
        const std::vector<Status> matte_faults_in_file = matte_faults(parser.entries, file.chain);
        apply_overrides(overrides, parser.entries, registry, file.chain, file.diagnostics);
        check_mattes(parser.entries, matte_faults_in_file, file);
    } catch (const std::bad_alloc&) {
        file.chain = Chain();
        file.diagnostics = out_of_memory_in(file_name);
    }
    return file;
}

}  // namespace

const ParameterTable& link_parameters() {
    static const ParameterTable table =
        ParameterTableBuilder<ChainLink>()
            .text("matte", &ChainLink::matte,
                  {.help = "objects that the pass treats separately: a channel, cryptomatte:NAME, "
                           "or the name "
                           "of a cryptomatte in its place; several names with commas",
                   .unset_means = "nothing"})
            .choice("matte_effect", &ChainLink::matte_effect, {"unblurred", "unmoved"},
                    {.help = "unblurred: the matte's objects stay as they are; unmoved: they stay "
                             "in place while the shutter is open (motion_blur, joint_blur)",
                     .unset_means = "unblurred"})
            .table();
    return table;
}

ChainFile parse_chain(std::string_view text, const std::string& file_name,
                      const PassRegistry& registry, const std::vector<std::string>& overrides) {
    return parse_tree([&] { return read_text_tree(text, file_name); }, file_name, registry,
                      overrides);
}

ChainFile parse_chain(const TextNode& root, const std::string& file_name,
                      const PassRegistry& registry, const std::vector<std::string>& overrides) {
    return parse_tree([&] { return TextTree{root, {}}; }, file_name, registry, overrides);
}

std::string write_chain(const Chain& chain) {
    std::string text = concat("postchain: ", kChainFileVersion, "\n");
    const std::string camera = write_rows(camera_parameters(), &chain.camera, "  ");
    if (!camera.empty()) text += "camera:\n" + camera;
    if (chain.links.empty()) return text + "passes: []\n";
    text += "passes:\n";
    for (const auto& link : chain.links) {
        const std::string rows =
            write_rows(*link.type->parameters, link.pass->parameters(), "      ") +
            write_rows(link_parameters(), &link, "      ");
        text += "  - " + link.type->name + (rows.empty() ? "" : ":") + "\n" + rows;
    }
    return text;
}

}  // namespace postchain
