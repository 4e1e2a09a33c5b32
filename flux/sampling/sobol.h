#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace scarp {

/// The bits in reverse: of a count, divided by 2^32, the van der Corput sequence.
std::uint32_t reverse_bits(std::uint32_t x);

/// Into how many shares a sequence can be dealt out.
inline constexpr std::size_t share_count = 16;

/// Points of the unit hypercube that fill it evenly: the Sobol sequence in four dimensions,
/// scrambled after Owen with a hash.
///
/// Any two seeds give independent randomisations, each point is uniformly distributed, and the
/// first 2^m points are a net.
/// Source: Sobol 1967, direction numbers of Joe and Kuo 2008; Owen 1995; hash of Laine and Karras
/// 2011 in the form of Burley 2020.
class ScrambledSobol {
 public:
  explicit ScrambledSobol(std::array<std::uint32_t, 4> seeds) : seeds_(seeds) {}

  /// Coordinates in [0, 1), multiples of 2^-32 shifted by half of one.
  std::array<double, 4> point(std::uint32_t index) const;
  /// Of a share of another sequence. The share is what the leading four bits of a fifth coordinate
  /// say: its first points fill the hypercube evenly, however many they are, and so do those of all
  /// shares together, as each has what its neighbours lack.
  std::array<double, 4> point_of_share(std::size_t share, std::uint32_t index) const;

 private:
  std::array<std::uint32_t, 4> seeds_;
};

}  // namespace scarp
