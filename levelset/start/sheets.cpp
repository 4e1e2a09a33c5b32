#include "levelset/start/sheets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "core/parallel.h"
#include "levelset/grid/band.h"
#include "levelset/grid/redistance.h"
#include "levelset/grid/stencil.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 16;

// The surface passes through such a node, in spacings: several times what shapes are dilated by.
constexpr float on_surface = 0.01F;

// A surface that is nearer than this has nodes on both sides around it.
constexpr float beside_surface = 0.9F;

// What a sheet changes at least.
constexpr float least_change = 0.1F;

struct Change {
  NodePlace place{};
  float value = 0;
};

class Sheets {
 public:
  explicit Sheets(const Band& band) : band_(band) {}

  /// What nodes on sheets have without these, and nodes beside sheets that lie between nodes.
  std::vector<Change> on_nodes() const;
  std::vector<Change> between_nodes() const;

 private:
  float at(Node node, int axis, int step) const {
    node[axis] += step;
    return band_.node(node[0], node[1], node[2]);
  }
  bool is_between_gas(const Node& node) const;
  float without_sheet(const Node& node, float here) const;
  bool has_other_side(const Node& node, float here, float limit) const;
  /// Calls use(phi, offset) for all nodes of a leaf nearer to the surface than a limit.
  template <class Use>
  void for_each_near(std::size_t leaf, float limit, const Use& use) const;

  template <class Without>
  std::vector<Change> changes(float limit, const Without& without) const;

  const Band& band_;
};

template <class Use>
void Sheets::for_each_near(std::size_t n, float limit, const Use& use) const {
  const Leaf& leaf = band_.leaves()[n];
  for (int i = 0; i < stored_nodes(band_, leaf, 0); ++i)
    for (int j = 0; j < stored_nodes(band_, leaf, 1); ++j)
      for (int k = 0; k < leaf_edge; ++k) {
        const int offset = leaf_offset(i, j, k);
        if (std::abs(leaf.phi[offset]) < limit) use(leaf.phi[offset], offset);
      }
}

// Whether gas lies on both sides of the node along an axis.
bool Sheets::is_between_gas(const Node& node) const {
  for (int axis = 0; axis < 3; ++axis)
    if (std::min(at(node, axis, -1), at(node, axis, 1)) > on_surface) return true;
  return false;
}

// The distance to a surface in a node beside this one or between the two, else as far as the band
// goes. Between gas the surface may be here all the same, in the tip of a ridge, unless the sheet
// goes on. Surfaces on nodes are solid, so amid gas those may lie beside this node, amid solid no
// gas may.
float Sheets::without_sheet(const Node& node, float here) const {
  const bool is_amid_own = !has_other_side(node, here, here > 0 ? on_surface : 0);
  if (!is_amid_own && !is_between_gas(node)) return here;
  const float side = is_amid_own ? std::copysign(1.0F, here) : 1.0F;
  float nearest = LevelSet::half_width;
  for (int axis = 0; axis < 3; ++axis) {
    for (const int step : {-1, 1}) {
      const float next = at(node, axis, step);
      if (next * side > 0) continue;
      if (!is_amid_own && std::abs(at(node, axis, -step)) > on_surface) return here;
      nearest = std::min(nearest, 1 - std::abs(next));
    }
  }
  return side * std::max(nearest, smallest_phi);
}

// Whether a node around this one is further than a limit on the other side.
bool Sheets::has_other_side(const Node& node, float here, float limit) const {
  const float side = std::copysign(1.0F, here);
  for (int axis = 0; axis < 3; ++axis)
    for (const int step : {-1, 1})
      if (at(node, axis, step) * side < -limit) return true;
  for (int i = -1; i <= 1; ++i)
    for (int j = -1; j <= 1; ++j)
      for (int k = -1; k <= 1; ++k)
        if (band_.node(node[0] + i, node[1] + j, node[2] + k) * side < -limit) return true;
  return false;
}

template <class Without>
std::vector<Change> Sheets::changes(float limit, const Without& without) const {
  const std::size_t count = band_.leaves().size();
  std::vector<std::vector<Change>> found((count + grain - 1) / grain);
  parallel_for(count, grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n)
      for_each_near(n, limit, [&](float phi, int offset) {
        const float value = without(node_at(band_.leaves()[n], offset), phi);
        if (value != phi) found[begin / grain].push_back({{static_cast<int>(n), offset}, value});
      });
  });
  std::vector<Change> all;
  for (const auto& range : found) all.insert(all.end(), range.begin(), range.end());
  return all;
}

std::vector<Change> Sheets::on_nodes() const {
  return changes(on_surface,
                 [this](const Node& node, float phi) { return without_sheet(node, phi); });
}

std::vector<Change> Sheets::between_nodes() const {
  return changes(beside_surface, [this](const Node& node, float phi) {
    return has_other_side(node, phi, 0) ? phi : std::copysign(LevelSet::half_width, phi);
  });
}

bool change(Band& band, const std::vector<Change>& changes) {
  for (const auto& [place, value] : changes)
    band.leaves()[static_cast<std::size_t>(place.leaf)].phi[place.offset] = value;
  return !changes.empty();
}

// Nodes that hardly change keep their phi: it is better known than what is found anew.
void keep_where_right(const Band& from, Band& to) {
  parallel_for(to.leaves().size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t n = begin; n < end; ++n) {
      Leaf& leaf = to.leaves()[n];
      for (int offset = 0; offset < leaf_size; ++offset) {
        const auto [i, j, k] = node_at(leaf, offset);
        const float before = from.node(i, j, k);
        if (std::abs(before - leaf.phi[offset]) < least_change) leaf.phi[offset] = before;
      }
    }
  });
  to.trim();
}

}  // namespace

void remove_sheets(LevelSet& phi) {
  Band& band = phi.band();
  const Sheets sheets(band);
  // The edge of a sheet is seen once the rest is gone.
  constexpr int most_passes = 3;
  bool any = false;
  for (int pass = 0; pass < most_passes && change(band, sheets.on_nodes()); ++pass) any = true;
  any = change(band, sheets.between_nodes()) || any;
  if (!any) return;
  const std::unique_ptr<Band> before = band.copy();
  redistance_fully(band);
  keep_where_right(*before, band);
}

}  // namespace scarp
