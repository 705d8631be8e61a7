// Files in the way of a subcommand's outputs: foreign files, and its inputs.
#pragma once

#include <functional>
#include <regex>
#include <set>

#include "tests/command/fixture.h"

namespace postchain::test {

namespace fs = std::filesystem;

inline const std::string kProfile =
    read_text(std::string(POSTCHAIN_SOURCE_DIR) + "/config/profiles/cycles.yaml");
inline const char* const kCamera =
    "{\"f_stop\": 2, \"focal_length_mm\": 50, \"sensor_width_mm\": 36}";
inline const char* const kStranger = "a stranger's";

// A command, and one of the files that it writes.
struct Writer {
    std::string file;
    Arguments command;
    // The command with a file as an additional input, and that file's content.
    std::function<Arguments(Arguments, const std::string& path)> reading = {};
    std::string content = {};
};

inline std::function<Arguments(Arguments, const std::string&)> option(const std::string& name) {
    return [name](const Arguments& command, const std::string& path) {
        return joined(command, {name, path});
    };
}
// The word at this place of the command is the path.
inline std::function<Arguments(Arguments, const std::string&)> word(size_t place) {
    return [place](Arguments command, const std::string& path) {
        command[place] = path;
        return command;
    };
}

class ReplaceTest : public CommandTest {
  protected:
    void SetUp() override {
        CommandTest::SetUp();
        write_sequence(at(""), {1, 2});
        write_frame(at("other.0001.exr"), make_planes(48, 32, 2));
        fresh();
    }

    // All files of a command are in this folder.
    std::string to(const std::string& name) const { return at("w/" + name); }
    void fresh() const {
        fs::remove_all(at("w"));
        fs::create_directory(at("w"));
    }
    void write(const std::string& path, const std::string& text) const {
        fs::create_directories(fs::path(path).parent_path());
        write_text(path, text);
    }

    // Every option named in a message is one of the subcommand's.
    void expect_remedy(const Outcome& outcome, const std::string& subcommand) {
        const std::string help = run({subcommand, "--help"}).out;
        const std::regex option("--[a-z][a-z-]+");
        std::sregex_iterator it(outcome.err.begin(), outcome.err.end(), option), end;
        EXPECT_NE(it, end) << "no remedy: " << outcome.err;
        for (; it != end; ++it)
            EXPECT_TRUE(contains(help, it->str()))
                << subcommand << " has no " << it->str() << ": " << outcome.err;
        for (const char* choice : {"skip", "overwrite"}) {
            const std::regex recommended(std::string("--on-existing [a-z ]*\\b") + choice);
            if (std::regex_search(outcome.err, recommended)) {
                EXPECT_TRUE(choices(help).contains(choice)) << choice << ": " << outcome.err;
            }
        }
    }
    // Those of --on-existing.
    static std::set<std::string> choices(const std::string& help) {
        std::smatch found;
        if (!std::regex_search(help, found, std::regex("--on-existing[^\\n{]*\\{([a-z,]+)\\}")))
            return {};
        std::set<std::string> words;
        std::istringstream list(found[1].str());
        for (std::string one; std::getline(list, one, ',');) words.insert(one);
        return words;
    }

    void check(const Writer& writer) {
        SCOPED_TRACE(writer.file);
        const std::string subcommand = writer.command[0], path = to(writer.file);
        fresh();
        expect_ends(run(writer.command), 0);
        ASSERT_TRUE(fs::is_regular_file(path));

        const auto expect_refused = [&](const Arguments& command, const std::string& kept) {
            const auto outcome = run(command);
            EXPECT_TRUE(contains(outcome.err, path)) << outcome.err;
            EXPECT_TRUE(read_text(path) == kept) << "it was replaced";
            EXPECT_EQ(files().size(), 1u) << "something was written";
            expect_remedy(outcome, subcommand);
            return outcome.code;
        };
        fresh();
        write(path, kStranger);
        EXPECT_EQ(expect_refused(joined(writer.command, {"--on-existing", "fail"}), kStranger), 5);
        if (!writer.reading) return;
        // Under another path too.
        const std::string typed = at(".//w/../w/" + writer.file);
        for (const auto& choice : choices(run({subcommand, "--help"}).out)) {
            fresh();
            write(path, writer.content);
            const int code = expect_refused(
                joined(writer.reading(writer.command, typed), {"--on-existing", choice}),
                writer.content);
            EXPECT_TRUE(code == 2 || (choice == "fail" && code != 0)) << choice << " " << code;
        }
    }

    std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const auto& entry : fs::recursive_directory_iterator(at("w")))
            if (!entry.is_directory()) names.push_back(entry.path().string());
        return names;
    }
};

}  // namespace postchain::test
