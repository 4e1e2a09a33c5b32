#include "core/random.h"

#include "core/vector_kernel.h"

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

// What the two words of a key grow by from round to round.
constexpr std::array<std::uint32_t, 2> key_steps{0x9E3779B9U, 0xBB67AE85U};
constexpr std::uint32_t rounds = 10;

inline std::array<std::uint32_t, 4> one_round(std::uint32_t c0, std::uint32_t c1, std::uint32_t c2,
                                              std::uint32_t c3,
                                              const std::array<std::uint32_t, 2>& key) {
  const Product a = multiply(0xD2511F53U, c0);
  const Product b = multiply(0xCD9E8D57U, c2);
  return {b.high ^ c1 ^ key[0], b.low, a.high ^ c3 ^ key[1], a.low};
}

inline void grow(std::array<std::uint32_t, 2>& key) {
  key[0] += key_steps[0];
  key[1] += key_steps[1];
}

// Round by round, so that the loop over rays becomes vectors.
SCARP_WIDE_KERNEL void draw_blocks(RandomStreams::Blocks& blocks,
                                   std::array<std::uint32_t, 2> key) {
  auto& [w0, w1, w2, w3] = blocks.words;
  for (std::uint32_t round = 0; round < rounds; ++round) {
    for (std::size_t k = 0; k < blocks.count; ++k) {
      const auto next = one_round(w0[k], w1[k], w2[k], w3[k], key);
      w0[k] = next[0];
      w1[k] = next[1];
      w2[k] = next[2];
      w3[k] = next[3];
    }
    grow(key);
  }
}

}  // namespace

std::array<std::uint32_t, 4> philox(std::array<std::uint32_t, 4> counter,
                                    std::array<std::uint32_t, 2> key) {
  for (std::uint32_t round = 0; round < rounds; ++round) {
    counter = one_round(counter[0], counter[1], counter[2], counter[3], key);
    grow(key);
  }
  return counter;
}

// Seed and species make the Philox key; they are mixed first, because consecutive seeds and species
// are the usual case and the two together hold more than its 64 bits. Block, ray and time step make
// the counter.
RandomStreams::RandomStreams(RandomStream::Key key) : time_step_(key.time_step) {
  const auto mixed = philox({static_cast<std::uint32_t>(key.seed),
                             static_cast<std::uint32_t>(key.seed >> 32), key.species, 0},
                            {0x5CA39F17U, 0x70D0B2E5U});
  key_ = {mixed[0], mixed[1]};
}

RandomStream RandomStreams::of_ray(std::uint64_t ray, std::uint32_t block) const {
  return {
      {block, static_cast<std::uint32_t>(ray), static_cast<std::uint32_t>(ray >> 32), time_step_},
      key_};
}

void RandomStreams::draw(Blocks& blocks) const {
  blocks.words[3].fill(time_step_);
  draw_blocks(blocks, key_);
}

RandomStream::RandomStream(Key key) : RandomStream(RandomStreams(key).of_ray(key.ray)) {}

std::uint32_t RandomStream::bits() {
  if (used_ == 4) {
    block_ = philox({counter_[0]++, counter_[1], counter_[2], counter_[3]}, key_);
    used_ = 0;
  }
  return block_[static_cast<std::size_t>(used_++)];
}

}  // namespace scarp
