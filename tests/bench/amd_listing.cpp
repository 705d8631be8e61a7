#include "tests/bench/amd_listing.h"

#include <algorithm>
#include <set>
#include <sstream>

#include "tests/bench/visit_marks.h"

namespace postchain::bench {
namespace {

struct Block {
    Instructions once;
    std::map<int, int> marks;
    std::vector<int> next;
};

// "s[16:23]" -> 16; "s7" -> 7; otherwise -1.
int first_register(const std::string& operand) {
    if (operand.empty() || operand[0] != 's') return -1;
    const size_t digit = operand.find_first_of("0123456789");
    return digit > 2 ? -1 : std::stoi(operand.substr(digit));
}

std::vector<std::string> operands_of(const std::string& line) {
    std::vector<std::string> operands;
    std::string word;
    int depth = 0;
    for (const char c : line) {
        if (c == '[') ++depth;
        if (c == ']') --depth;
        if (depth == 0 && (c == ',' || c == ' ')) {
            if (!word.empty()) operands.push_back(word);
            word.clear();
        } else {
            word += c;
        }
    }
    if (!word.empty()) operands.push_back(word);
    return operands;
}

// Reads instructions one after the other.
class Reader {
  public:
    void read(const std::string& line, Block& block) {
        const std::vector<std::string> words = operands_of(line);
        const std::string& name = words[0];
        const auto begins = [&](const char* text) { return name.starts_with(text); };
        if (begins("s_load_dword")) {
            descriptors_[first_register(words[1])] =
                words.size() > 3 && words[3] != "null" ? uint32_t(std::stoul(words[3], nullptr, 0))
                                                       : 0;
            return;
        }
        if (const int mark = mark_of(name, line); mark >= 0) {
            ++block.marks[mark];
            return;
        }
        if (begins("image_")) {
            int from = -1;
            for (size_t i = 2; i < words.size() && from < 0; ++i) from = first_register(words[i]);
            const auto known = descriptors_.find(from);
            block.once.loads += 1;
            if (known != descriptors_.end())
                (begins("image_store") ? block.once.stored : block.once.texels)[known->second] += 1;
        } else if (begins("buffer_") || begins("global_") || begins("scratch_")) {
            block.once.loads += 1;
        } else if (begins("ds_")) {
            block.once.shared += 1;
        } else if (!begins("s_waitcnt") && !begins("s_nop") && !begins("s_clause") &&
                   !begins("s_inst_prefetch") && !begins("s_buffer_load") && !begins("s_endpgm") &&
                   !begins("s_code_end") && !begins("s_delay_alu")) {
            block.once.alu += 1;
        }
    }

  private:
    static int mark_of(const std::string& name, const std::string& line) {
        const size_t at = line.find(" offset:");
        if (!name.starts_with("buffer_store") || at == line.npos) return -1;
        const int offset = std::stoi(line.substr(at + 8)) - kFirstMarkOffset;
        return offset >= 0 && offset < 4 * kMostMarks && line.find("offen") == line.npos
                   ? offset / 4
                   : -1;
    }
    std::map<int, uint32_t> descriptors_;  // by the first register that holds one
};

std::vector<Block> blocks_of(const std::string& assembly) {
    std::vector<std::vector<std::string>> lines(1);  // of each block
    std::map<std::string, int> labels;
    std::istringstream in(assembly);
    std::string line;
    bool ends = false;
    while (std::getline(in, line)) {
        line = line.substr(0, line.find(';'));
        const size_t begin = line.find_first_not_of(" \t");
        if (begin == line.npos) continue;
        line = line.substr(begin, line.find_last_not_of(" \t") + 1 - begin);
        if (line.starts_with("BB") && line.ends_with(":")) {
            if (!lines.back().empty() || !labels.empty()) lines.emplace_back();
            labels[line.substr(0, line.size() - 1)] = int(lines.size()) - 1;
            ends = false;
            continue;
        }
        if (!line.starts_with("s_") && !line.starts_with("v_") && !line.starts_with("image_") &&
            !line.starts_with("buffer_") && !line.starts_with("ds_") &&
            !line.starts_with("global_") && !line.starts_with("scratch_") &&
            !line.starts_with("exp"))
            continue;
        if (ends) lines.emplace_back();
        ends = line.starts_with("s_cbranch") || line.starts_with("s_branch");
        lines.back().push_back(line);
    }
    std::vector<Block> blocks(lines.size());
    Reader reader;
    for (size_t b = 0; b < lines.size(); ++b) {
        bool goes_on = b + 1 < lines.size();
        for (const std::string& one : lines[b]) {
            reader.read(one, blocks[b]);
            const std::vector<std::string> words = operands_of(one);
            if (words[0] == "s_endpgm") goes_on = false;
            if (!words[0].starts_with("s_cbranch") && words[0] != "s_branch") continue;
            const auto label = labels.find(words[1]);
            if (label != labels.end()) blocks[b].next.push_back(label->second);
            if (words[0] == "s_branch") goes_on = false;
        }
        if (goes_on) blocks[b].next.push_back(int(b) + 1);
    }
    return blocks;
}

using Edges = std::vector<std::vector<int>>;
using Sets = std::vector<std::vector<bool>>;

// For each node, those through which every way from `entry` to it leads; all, if there is no way.
Sets dominators(const Edges& before, int entry) {
    const size_t count = before.size();
    Sets sets(count, std::vector<bool>(count, true));
    sets[size_t(entry)].assign(count, false);
    sets[size_t(entry)][size_t(entry)] = true;
    for (bool changed = true; changed;) {
        changed = false;
        for (size_t n = 0; n < count; ++n) {
            if (int(n) == entry || before[n].empty()) continue;
            std::vector<bool> now(count, true);
            for (const int other : before[n])
                for (size_t i = 0; i < count; ++i) now[i] = now[i] && sets[size_t(other)][i];
            now[n] = true;
            if (now != sets[n]) {
                sets[n] = now;
                changed = true;
            }
        }
    }
    return sets;
}

}  // namespace

void Instructions::add(const Instructions& other, double times) {
    alu += times * other.alu;
    loads += times * other.loads;
    shared += times * other.shared;
    for (const auto& [descriptor, count] : other.texels) texels[descriptor] += times * count;
    for (const auto& [descriptor, count] : other.stored) stored[descriptor] += times * count;
}

Listing::Listing(const std::string& assembly) {
    const std::vector<Block> blocks = blocks_of(assembly);
    const size_t count = blocks.size(), end = count;  // one more: after the last
    Edges next(count + 1), before(count + 1);
    for (size_t b = 0; b < count; ++b) {
        next[b] = blocks[b].next;
        if (next[b].empty()) next[b].push_back(int(end));
        for (const int other : next[b]) before[size_t(other)].push_back(int(b));
    }
    const Sets dominate = dominators(before, 0), after = dominators(next, int(end));
    // Blocks of each loop, by the block at which it begins.
    std::map<int, std::set<int>> loops;
    for (size_t b = 0; b < count; ++b)
        for (const int head : next[b]) {
            if (!dominate[b][size_t(head)]) continue;
            std::set<int>& body = loops[head];
            body.insert(head);
            std::vector<int> open = {int(b)};
            while (!open.empty()) {
                const int one = open.back();
                open.pop_back();
                if (!body.insert(one).second) continue;
                for (const int other : before[size_t(one)]) open.push_back(other);
            }
        }
    const auto loops_around = [&](size_t b) {
        std::set<int> around;
        for (const auto& [head, body] : loops)
            if (body.count(int(b))) around.insert(head);
        return around;
    };
    std::vector<std::set<int>> around;
    for (size_t b = 0; b < count; ++b) around.push_back(loops_around(b));
    // The part of each block; blocks that dominate come first in a part.
    std::vector<int> part_of(count, -1);
    for (size_t b = 0; b < count; ++b) {
        if (part_of[b] >= 0) continue;
        part_of[b] = int(parts_.size());
        parts_.emplace_back();
        for (size_t other = 0; other < count; ++other)
            if (part_of[other] < 0 && dominate[other][b] && after[b][other] &&
                around[b] == around[other])
                part_of[other] = part_of[b];
    }
    for (size_t b = 0; b < count; ++b) {
        ListedPart& part = parts_[size_t(part_of[b])];
        part.once.add(blocks[b].once, 1);
        for (const auto& [mark, copies] : blocks[b].marks) part.marks[mark] += copies;
    }
    // The nearest dominator of another part, which most others dominate. The first block of a part
    // decides.
    std::vector<bool> known(parts_.size(), false);
    for (size_t b = 0; b < count; ++b) {
        const auto own = size_t(part_of[b]);
        if (known[own]) continue;
        known[own] = true;
        parts_[own].loops = around[b];
        ptrdiff_t most = 0;
        for (size_t other = 0; other < b && !before[b].empty(); ++other) {
            if (!dominate[b][other] || part_of[other] == part_of[b]) continue;
            const ptrdiff_t depth =
                std::count(dominate[other].begin(), dominate[other].end(), true);
            if (depth <= most) continue;
            most = depth;
            parts_[own].outer = part_of[other];
        }
    }
}

std::vector<double> Listing::visits_of_parts(const std::vector<double>& visits) const {
    std::map<int, double> copies;
    for (const ListedPart& part : parts_)
        for (const auto& [mark, count] : part.marks)
            if (visits.at(size_t(mark)) >= 0) copies[mark] += count;
    // Copies share their visits equally at first, then as often as what is around them runs.
    std::map<int, double> weights = copies;
    const auto is_counted = [&](const ListedPart& part) {
        return std::any_of(part.marks.begin(), part.marks.end(),
                           [&](const auto& one) { return visits[size_t(one.first)] >= 0; });
    };
    std::vector<double> result(parts_.size(), 1), around(parts_.size(), 1);
    constexpr int kTurns = 4;
    for (int turn = 0; turn < kTurns; ++turn) {
        std::map<std::set<int>, double> of_loop;
        for (size_t i = 0; i < parts_.size(); ++i) {
            double once = -1, shared = 0;
            for (const auto& [mark, count] : parts_[i].marks) {
                const double all = visits.at(size_t(mark));
                if (all < 0) continue;
                if (copies[mark] == 1)
                    once = std::max(once, all);
                else if (weights[mark] > 0)
                    shared = std::max(shared, all * around[i] / weights[mark]);
            }
            result[i] = once >= 0 ? once : shared;
            double& most = of_loop[parts_[i].loops];
            most = std::max(most, result[i]);
        }
        // Parts that dominate others come before them.
        for (size_t i = 0; i < parts_.size(); ++i) {
            const int outer = parts_[i].outer;
            if (is_counted(parts_[i])) continue;
            result[i] = outer >= 0 ? result[size_t(outer)] : 0;
            if (outer < 0 || parts_[size_t(outer)].loops != parts_[i].loops)
                result[i] = std::max(result[i], of_loop[parts_[i].loops]);
        }
        weights.clear();
        for (size_t i = 0; i < parts_.size(); ++i) {
            const bool is_exact =
                std::any_of(parts_[i].marks.begin(), parts_[i].marks.end(), [&](const auto& one) {
                    return copies[one.first] == 1 && visits[size_t(one.first)] >= 0;
                });
            const int outer = parts_[i].outer;
            around[i] = is_exact || outer < 0 ? result[i] : result[size_t(outer)];
            for (const auto& [mark, count] : parts_[i].marks) weights[mark] += count * around[i];
        }
    }
    return result;
}

Instructions Listing::total(const std::vector<double>& visits) const {
    const std::vector<double> times = visits_of_parts(visits);
    Instructions sum;
    for (size_t i = 0; i < parts_.size(); ++i) sum.add(parts_[i].once, times[i]);
    return sum;
}

Instructions Listing::once() const {
    Instructions sum;
    for (const ListedPart& part : parts_) sum.add(part.once, 1);
    return sum;
}

bool Listing::loads_in(int mark) const {
    return std::any_of(parts_.begin(), parts_.end(), [&](const ListedPart& part) {
        return part.marks.count(mark) > 0 && part.once.loads > 0;
    });
}

}  // namespace postchain::bench
