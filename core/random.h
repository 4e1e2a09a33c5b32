#pragma once

#include <array>
#include <cstdint>

namespace scarp {

/// Counter-based random numbers: the n-th number of a stream is a pure function of (seed, time
/// step, species, ray, n).
///
/// A stream may be opened anywhere, in any order, on any thread: the numbers are the same.
/// Source: Salmon et al. 2011, Philox 4x32 with 10 rounds.
class RandomStream {
 public:
  struct Key {
    std::uint64_t seed = 0;
    std::uint32_t time_step = 0;
    std::uint32_t species = 0;
    std::uint64_t ray = 0;
  };

  explicit RandomStream(Key key);

  /// A number in [0, 1), a multiple of 2^-24.
  float uniform() { return static_cast<float>(bits() >> 8) * 0x1.0p-24F; }

  /// A number in [0, 1), a multiple of 2^-32.
  double uniform_double() { return bits() * 0x1.0p-32; }

  std::uint32_t bits();

 private:
  std::array<std::uint32_t, 4> counter_;
  std::array<std::uint32_t, 2> key_;
  std::array<std::uint32_t, 4> block_{};
  int used_ = 4;
};

/// One block of Philox 4x32-10.
std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                    std::array<std::uint32_t, 2> key);

}  // namespace scarp
