// A folder with two frames, their ground truth and a chain, for commands that measure it.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/command/command.h"
#include "tests/measure/experiment/support.h"

namespace postchain::test {

class MeasureCommand : public ::testing::Test {
  protected:
    void SetUp() override {
        write_sequence(folder_.path(), 2);
        write_truth(folder_.path(), 1, 2, 0.125f);
        write_text(at("chain.yaml"), kChainText);
    }
    std::string at(const std::string& name) const { return folder_.path(name); }
    // The command with its input, its ground truth and the software device; options of `more`
    // replace these or are added.
    Arguments measured(Arguments command, const Arguments& more, bool truth = true) const {
        command.insert(command.end(), {"-i", at("in.####.exr"), "--device", "software"});
        if (truth) command.insert(command.end(), {"-r", at("truth.####.exr")});
        const size_t given = command.size();
        for (size_t i = 0; i < more.size(); ++i) {
            const auto end = command.begin() + ptrdiff_t(given);
            const auto same = std::find(command.begin(), end, more[i]);
            if (more[i][0] == '-' && same != end)
                *(same + 1) = more[++i];
            else
                command.push_back(more[i]);
        }
        return command;
    }
    TempFolder folder_;
};

}  // namespace postchain::test
