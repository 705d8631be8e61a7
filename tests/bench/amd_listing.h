// The instructions of a program that Mesa's compiler for AMD lists, by the marks in it
// (visit_marks.h).
//
//   listing --blocks, jumps--> parts that run equally often --marks--> visits of each part
//
// A part is one or more blocks in one loop of which each runs if the others run (control
// equivalence). It runs as often as its most frequent mark; without a mark, as often as the part
// that dominates it, or in another loop as the marked parts of that loop. A mark of which the
// compiler made several copies (unrolled loops, functions in several places) counts only in parts
// without another one, and shares its visits by how often the parts around its copies run.
#pragma once

#include <cstdint>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace postchain::bench {

struct Instructions {
    double alu = 0;     // vector and scalar, without loads, stores, waits and hints
    double loads = 0;   // of textures and buffers
    double shared = 0;  // of shared memory
    // Texels of each descriptor, by its offset in the descriptor set.
    std::map<uint32_t, double> texels;  // read
    std::map<uint32_t, double> stored;

    void add(const Instructions& other, double times);
};

struct ListedPart {
    Instructions once;
    std::map<int, int> marks;  // number -> copies in this part
    int outer = -1;            // the part that dominates it
    std::set<int> loops;       // around it, by their first blocks
};

class Listing {
  public:
    // `assembly`: as VK_KHR_pipeline_executable_properties gives it.
    explicit Listing(const std::string& assembly);

    const std::vector<ListedPart>& parts() const { return parts_; }
    // Visits of each part. `visits`: of each mark; below 0: the mark does not count.
    std::vector<double> visits_of_parts(const std::vector<double>& visits) const;
    // All parts, each times its visits.
    Instructions total(const std::vector<double>& visits) const;
    // The sum over all parts, each once.
    Instructions once() const;
    bool loads_in(int mark) const;  // does a part with this mark load texels?

  private:
    std::vector<ListedPart> parts_;
};

}  // namespace postchain::bench
