#pragma once

#include <array>
#include <cstddef>
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

  /// A number in [0, 1), a multiple of 2^-32.
  double uniform() { return bits() * 0x1.0p-32; }

  std::uint32_t bits();

  /// The first block of four numbers of which none was drawn yet.
  std::uint32_t next_block() const { return counter_[0]; }

 private:
  friend class RandomStreams;
  RandomStream(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key)
      : counter_(counter), key_(key) {}

  std::array<std::uint32_t, 4> counter_;
  std::array<std::uint32_t, 2> key_;
  std::array<std::uint32_t, 4> block_{};
  int used_ = 4;
};

/// The streams of all rays of one seed, time step and species.
class RandomStreams {
 public:
  /// Of key, all but the ray.
  explicit RandomStreams(RandomStream::Key key);

  /// From its numbers of a block of four on.
  RandomStream of_ray(std::uint64_t ray, std::uint32_t block = 0) const;

  /// A block of each of some rays, and its four numbers.
  struct Blocks {
    static constexpr std::size_t most = 64;
    using Words = std::array<std::uint32_t, most>;

    std::array<Words, 4> words;
    std::size_t count = 0;

    void add(std::uint64_t ray, std::uint32_t block) {
      words[0][count] = block;
      words[1][count] = static_cast<std::uint32_t>(ray);
      words[2][count] = static_cast<std::uint32_t>(ray >> 32);
      ++count;
    }
  };

  /// Puts the numbers in place of the names.
  void draw(Blocks& blocks) const;

 private:
  std::array<std::uint32_t, 2> key_{};
  std::uint32_t time_step_;
};

/// One block of Philox 4x32-10.
std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                    std::array<std::uint32_t, 2> key);

}  // namespace scarp
