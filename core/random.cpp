#include "core/random.h"

namespace scarp {

namespace {

struct Product {
  std::uint32_t high;
  std::uint32_t low;
};

Product multiply(std::uint32_t a, std::uint32_t b) {
  const std::uint64_t product = std::uint64_t{a} * b;
  return {static_cast<std::uint32_t>(product >> 32), static_cast<std::uint32_t>(product)};
}

}  // namespace

std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                    std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const Product a = multiply(0xD2511F53U, counter[0]);
    const Product b = multiply(0xCD9E8D57U, counter[2]);
    counter = {b.high ^ counter[1] ^ key[0], b.low, a.high ^ counter[3] ^ key[1], a.low};
    key[0] += 0x9E3779B9U;
    key[1] += 0xBB67AE85U;
  }
  return counter;
}

// Seed and species make the Philox key; they are mixed first, because consecutive seeds and species
// are the usual case and the two together hold more than its 64 bits. Block, ray and time step make
// the counter.
RandomStream::RandomStream(Key key)
    : counter_{0, static_cast<std::uint32_t>(key.ray), static_cast<std::uint32_t>(key.ray >> 32),
               key.time_step} {
  const auto mixed = philox({static_cast<std::uint32_t>(key.seed),
                             static_cast<std::uint32_t>(key.seed >> 32), key.species, 0},
                            {0x5CA39F17U, 0x70D0B2E5U});
  key_ = {mixed[0], mixed[1]};
}

std::uint32_t RandomStream::bits() {
  if (used_ == 4) {
    block_ = philox({counter_[0]++, counter_[1], counter_[2], counter_[3]}, key_);
    used_ = 0;
  }
  return block_[static_cast<std::size_t>(used_++)];
}

}  // namespace scarp
