// Counts what the guest asks of GL. libepoxy calls GL through a variable for each function; here
// each of those that the library uses is replaced by one that counts and calls on.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace postchain::test {

// By name, since start(). Calls of the test's own count too.
class GlCalls {
  public:
    static void start();
    static std::map<std::string, uint64_t> stop();
    // Every function that is counted.
    static std::vector<std::string> names();
};

// From now on none of these functions is called on, only counted: a GL that does nothing, and whose
// queries leave what they were given.
void silence_gl(bool silent);
// Lets the next calls of a function do nothing: glTextureStorage2D, as if memory were spent.
void refuse_texture_storage(bool refuse);
// Does the context say that it would tell of its loss, and does it?
void report_loss(bool tells, bool lost);

}  // namespace postchain::test
