// Random numbers that are the same on every machine.
#pragma once

#include <cmath>
#include <cstdint>

namespace postchain::test {

class Random {
  public:
    explicit Random(uint64_t seed) : state_(seed) {}
    uint64_t next() {  // splitmix64
        uint64_t z = (state_ += 0x9e3779b97f4a7c15u);
        z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
        z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
        return z ^ (z >> 31);
    }
    double real() { return double(next() >> 11) * 0x1p-53; }
    double real(double low, double high) { return low + (high - low) * real(); }
    double logarithmic(double low, double high) { return low * std::pow(high / low, real()); }
    int whole(int low, int high) { return low + int(next() % uint64_t(high - low + 1)); }
    bool chance(double p) { return real() < p; }

  private:
    uint64_t state_;
};

}  // namespace postchain::test
