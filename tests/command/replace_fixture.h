// Files in the way of a subcommand's outputs: foreign files, and its inputs.
#pragma once

#include <functional>
#include <regex>

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
    return [name](Arguments command, const std::string& path) {
        command.insert(command.end(), {name, path});
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

    // Every option named in a message is one of the subcommand's.
    void expect_remedy(const Outcome& outcome, const std::string& subcommand) {
        if (help_of_ != subcommand) help_ = run({subcommand, "--help"}).out;
        help_of_ = subcommand;
        const std::regex word("--[a-z][a-z-]+");
        int count = 0;
        for (std::sregex_iterator it(outcome.err.begin(), outcome.err.end(), word), end; it != end;
             ++it) {
            ++count;
            EXPECT_TRUE(contains(help_, it->str()))
                << subcommand << " has no " << it->str() << ": " << outcome.err;
        }
        EXPECT_GT(count, 0) << "no remedy: " << outcome.err;
        for (const char* choice : {"skip", "overwrite"}) {
            const std::regex recommended(std::string("--on-existing [a-z ]*\\b") + choice);
            if (!std::regex_search(outcome.err, recommended)) continue;
            EXPECT_TRUE(choices().count(choice)) << choice << ": " << outcome.err;
        }
    }
    std::set<std::string> choices() const {
        std::smatch found;
        std::set<std::string> words;
        const std::regex line("--on-existing[^\\n{]*\\{([a-z,]+)\\}");
        if (!std::regex_search(help_, found, line)) return words;
        std::istringstream list(found[1].str());
        for (std::string word; std::getline(list, word, ',');) words.insert(word);
        return words;
    }

    // The links of one writer's file are tried: what is a link is decided in one place.
    void check_links_too(const Writer& writer) {
        all_links_of_ = writer.file;
        check(writer);
    }
    void check(const Writer& writer) {
        SCOPED_TRACE(writer.file);
        const std::string subcommand = writer.command[0], path = to(writer.file);
        fresh();
        const auto free = run(writer.command);
        EXPECT_EQ(free.code, 0) << free.text();
        ASSERT_TRUE(fs::is_regular_file(path)) << free.text();

        fresh();
        fs::create_directories(fs::path(path).parent_path());
        write_text(path, kStranger);
        Arguments fail = writer.command;
        fail.insert(fail.end(), {"--on-existing", "fail"});
        const auto refused = run(fail);
        EXPECT_EQ(refused.code, 5) << refused.text();
        EXPECT_TRUE(read_text(path) == kStranger) << "it was replaced";
        EXPECT_TRUE(contains(refused.err, path)) << refused.err;
        expect_remedy(refused, subcommand);
        EXPECT_EQ(files().size(), 1u) << "something was written";

        if (!writer.reading) return;
        check_input(writer, "the file itself", [](const std::string&, const std::string&) {});
        if (writer.file != all_links_of_) return;
        check_input(writer, "a hard link", [](const std::string& from, const std::string& to) {
            fs::create_hard_link(from, to);
        });
        check_input(writer, "a symbolic link", [](const std::string& from, const std::string& to) {
            fs::create_symlink(from, to);
        });
    }

    // `link`: the output is a link to the input, which is elsewhere; otherwise the output is the
    // input.
    void check_input(const Writer& writer, const std::string& how,
                     const std::function<void(const std::string&, const std::string&)>& link) {
        SCOPED_TRACE(how);
        const std::string path = to(writer.file);
        for (const auto& choice : choices()) {
            fresh();
            fs::create_directories(fs::path(path).parent_path());
            std::string input = path;
            if (how != "the file itself") input = at("input_file.yaml");
            write_text(input, writer.content);
            link(input, path);
            // Under another path too: an inode has no name.
            const std::string typed =
                how == "the file itself" ? at(".//w/../w/" + writer.file) : input;
            Arguments command = writer.reading(writer.command, typed);
            command.insert(command.end(), {"--on-existing", choice});
            const auto outcome = run(command);
            EXPECT_EQ(outcome.code, choice == "fail" ? outcome.code : 2) << outcome.text();
            EXPECT_NE(outcome.code, 0);
            EXPECT_TRUE(contains(outcome.err, path)) << outcome.err;
            EXPECT_TRUE(read_text(input) == writer.content) << "it was replaced";
            EXPECT_TRUE(fs::exists(path) && fs::equivalent(path, input));
            EXPECT_EQ(fs::is_symlink(path), how == "a symbolic link");
            EXPECT_EQ(files().size(), 1u) << "something was written";
            expect_remedy(outcome, writer.command[0]);
        }
    }

    std::vector<std::string> files() const {
        std::vector<std::string> names;
        for (const auto& entry : fs::recursive_directory_iterator(at("w")))
            if (!entry.is_directory()) names.push_back(entry.path().string());
        return names;
    }

    std::string all_links_of_;
    std::string help_of_, help_;  // a subcommand, and its printed options
};

}  // namespace postchain::test
