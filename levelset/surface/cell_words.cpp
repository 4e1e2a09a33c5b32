#include "levelset/surface/cell_words.h"

#include <algorithm>

#include "levelset/grid/stencil.h"

namespace scarp {

namespace {

// Bits of a word are rows of eight along z.
constexpr std::uint64_t first_of_rows = 0x0101010101010101U;
constexpr std::uint64_t all_but_last_of_rows = 0x7f7f7f7f7f7f7f7fU;

}  // namespace

CellLeaves::CellLeaves(const Band& band, std::size_t n) {
  const Leaf& here = band.leaves()[n];
  std::array<std::array<int, 2>, 2> column{};
  for (int axis = 0; axis < 2; ++axis) {
    nodes[axis] = stored_nodes(band, here, axis);
    cells[axis] = std::min(leaf_edge, band.frame().cells[axis] - here.origin[axis]);
    const int first = here.origin[axis] >> 3;
    const bool is_last = first + 1 == band.column_count(axis);
    const bool wraps = is_last && band.frame().boundary[axis] == Boundary::periodic;
    wrapped |= (wraps ? 1 : 0) << axis;
    column[axis] = {first, wraps ? 0 : first + 1};
  }
  for (int upper = 0; upper < 8; ++upper) {
    leaf[upper] = band.find(column[0][upper & 1], column[1][upper >> 1 & 1],
                            (here.origin[2] >> 3) + (upper >> 2));
  }
}

CellWords::CellWords(const CellLeaves& leaves, const std::vector<LeafMask>& solid)
    : leaves_(leaves) {
  const LeafMask& here = solid[static_cast<std::size_t>(leaves.leaf[0])];
  // clang 14 cannot capture structured bindings.
  const int i_count = leaves.nodes[0];
  const int j_count = leaves.nodes[1];
  // A missing leaf is further from the surface than a cell: all nodes next to it are on its side,
  // and the last one here is next to all seven.
  const bool last = (here[i_count - 1] >> (8 * j_count - 1) & 1) != 0;
  const LeafMask missing = [last] {
    LeafMask mask;
    mask.fill(last ? ~0ULL : 0);
    return mask;
  }();
  std::array<const LeafMask*, 8> of{};
  for (int upper = 0; upper < 8; ++upper) {
    const int leaf = leaves.leaf[upper];
    of[upper] = leaf >= 0 ? &solid[static_cast<std::size_t>(leaf)] : &missing;
  }
  const int last_row = 8 * (j_count - 1);
  const auto next_row = [&](std::uint64_t word, std::uint64_t beyond) {
    return (word >> 8 & rows(j_count - 1)) | (beyond & 0xff) << last_row;
  };
  const auto next_in_row = [](std::uint64_t word, std::uint64_t beyond) {
    return (word >> 1 & all_but_last_of_rows) | (beyond & first_of_rows) << 7;
  };
  for (int i = 0; i <= i_count; ++i) {
    const int x = i == i_count ? 1 : 0;
    const int from = x == 1 ? 0 : i;
    const std::uint64_t word = (*of[x])[from];
    const std::uint64_t above = (*of[x | 4])[from];
    words_[0][i] = word;
    words_[1][i] = next_row(word, (*of[x | 2])[from]);
    words_[2][i] = next_in_row(word, above);
    words_[3][i] = next_in_row(words_[1][i], next_row(above, (*of[x | 6])[from]));
  }
}

std::uint64_t CellWords::cut_edges(int axis, int i) const {
  const auto [i_count, j_count] = axis == 0   ? std::array{leaves_.cells[0], leaves_.nodes[1]}
                                  : axis == 1 ? std::array{leaves_.nodes[0], leaves_.cells[1]}
                                              : leaves_.nodes;
  if (i >= i_count) return 0;
  const std::uint64_t next = axis == 0 ? words_[0][i + 1] : words_[axis][i];
  return (words_[0][i] ^ next) & rows(j_count);
}

std::uint64_t CellWords::cut_faces(int normal, int i) const {
  const int i_count = normal == 0 ? leaves_.nodes[0] : leaves_.cells[0];
  const int j_count = normal == 1 ? leaves_.nodes[1] : leaves_.cells[1];
  if (i >= i_count) return 0;
  // Corners of the face: two of one row of words, and two of another or of the next i.
  const int other = normal == 2 ? 1 : 2;
  const std::uint64_t a = words_[0][i];
  const std::uint64_t b = words_[other][i];
  const std::uint64_t c = normal == 0 ? words_[1][i] : words_[0][i + 1];
  const std::uint64_t d = normal == 0 ? words_[3][i] : words_[other][i + 1];
  return (a | b | c | d) & ~(a & b & c & d) & rows(j_count);
}

std::uint64_t CellWords::cut_cells(int i) const {
  if (i >= leaves_.cells[0]) return 0;
  std::uint64_t any = 0;
  std::uint64_t all = ~0ULL;
  for (const auto& words : words_) {
    any |= words[i] | words[i + 1];
    all &= words[i] & words[i + 1];
  }
  return any & ~all & rows(leaves_.cells[1]);
}

}  // namespace scarp
