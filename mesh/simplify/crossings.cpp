#include "mesh/simplify/crossings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "mesh/lanes.h"

namespace scarp {

namespace {

using Corners = std::array<Vec3d, 3>;

/// Cosine between the normals of two facets above which they are parts of one sheet. Two sheets
/// that have passed through each other enclose a thin space whose inside is out; around it there
/// are facets that face apart. This leaves out nearly all pairs of neighbours.
constexpr float cosine_of_sheet = 0.5F;

/// As Box, rounded: what meets there meets here.
struct RoundedBox {
  std::array<float, 3> lower{1e30F, 1e30F, 1e30F};
  std::array<float, 3> upper{-1e30F, -1e30F, -1e30F};

  void add(const RoundedBox& other) {
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis] = std::min(lower[axis], other.lower[axis]);
      upper[axis] = std::max(upper[axis], other.upper[axis]);
    }
  }

  bool meets(const RoundedBox& other) const {
    int apart = 0;
    for (int axis = 0; axis < 3; ++axis) {
      apart |= static_cast<int>(upper[axis] < other.lower[axis]) |
               static_cast<int>(other.upper[axis] < lower[axis]);
    }
    return apart == 0;
  }

  /// Where on a Z curve through this box the lower corner of another one lies.
  std::uint32_t curve(const RoundedBox& other) const {
    constexpr std::uint32_t steps = 1024;
    const float size =
        std::max({upper[0] - lower[0], upper[1] - lower[1], upper[2] - lower[2], 1e-30F});
    std::uint32_t key = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const float along = (other.lower[axis] - lower[axis]) / size * steps;
      const std::uint32_t step = std::min(static_cast<std::uint32_t>(along), steps - 1);
      for (std::uint32_t bit = 0; bit < 10; ++bit) key |= (step >> bit & 1U) << (3 * bit + axis);
    }
    return key;
  }
};

RoundedBox rounded(const Box& box) {
  RoundedBox result;
  for (int axis = 0; axis < 3; ++axis) {
    result.lower[axis] = static_cast<float>(box.lower[axis]);
    result.upper[axis] = static_cast<float>(box.upper[axis]);
  }
  return result;
}

Triangle vertices_of(const CollapseMesh& mesh, std::uint32_t f) {
  return {mesh.topology.origin(3 * f), mesh.topology.origin(3 * f + 1),
          mesh.topology.origin(3 * f + 2)};
}

Box box_of(const CollapseMesh& mesh, std::uint32_t f) {
  Box box;
  for (const std::uint32_t v : vertices_of(mesh, f)) box.add(mesh.r[v]);
  return box;
}

/// Eight facets, so that a box is compared with all of them at once.
struct Group {
  static constexpr std::size_t size = 8;

  std::array<std::array<float, size>, 3> lower;
  std::array<std::array<float, size>, 3> upper;
  std::array<std::array<float, size>, 3> normal;  ///< of length 1
  std::array<std::uint32_t, size> facets;         ///< HalfEdges::none where there are fewer
  Vec3f flat;                                     ///< unit normal, if all face the same way

  std::size_t count() const {
    const auto end = std::find(facets.begin(), facets.end(), HalfEdges::none);
    return static_cast<std::size_t>(end - facets.begin());
  }

  RoundedBox box(std::size_t i) const {
    return {{lower[0][i], lower[1][i], lower[2][i]}, {upper[0][i], upper[1][i], upper[2][i]}};
  }

  /// Around all of them.
  RoundedBox box() const {
    RoundedBox all;
    for (std::size_t i = 0; i < size; ++i) all.add(box(i));
    return all;
  }

  void put(std::size_t i, std::uint32_t f, const RoundedBox& box, Vec3d n) {
    facets[i] = f;
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis][i] = box.lower[axis];
      upper[axis][i] = box.upper[axis];
      normal[axis][i] = static_cast<float>(n[axis]);
    }
  }

  /// To be called once all are put in.
  void find_flat() {
    constexpr float cosine_around = 0.966F;  // a quarter of the angle between parts of one sheet
    const auto n = [this](std::size_t i) {
      return Vec3f{normal[0][i], normal[1][i], normal[2][i]};
    };
    Vec3f sum;
    for (std::size_t i = 0; i < size; ++i) sum += n(i);
    const Vec3f mean(normalized(Vec3d(sum)));
    bool is_flat = true;
    for (std::size_t i = 0; i < count(); ++i) is_flat &= dot(n(i), mean) > cosine_around;
    flat = is_flat ? mean : Vec3f{};
  }

  /// Whether all facets of both are parts of one sheet.
  bool is_one_sheet_with(const Group& other) const {
    constexpr float cosine_between = 0.866F;  // half the angle
    return dot(flat, other.flat) > cosine_between;
  }

  /// Calls visit(facet) for those whose boxes meet the given one.
  template <class Visit>
  void for_each_meeting(const RoundedBox& box, const Visit& visit) const {
    for_each_meeting(box, {}, visit);
  }

  /// The same without those that face like n, a vector of length 1.
  template <class Visit>
  void for_each_meeting(const RoundedBox& box, Vec3f n, const Visit& visit) const {
    const auto [x0, y0, z0] = box.lower;
    const auto [x1, y1, z1] = box.upper;
    std::array<int, size> apart;
    for (std::size_t i = 0; i < size; ++i) {
      apart[i] = static_cast<int>(x1 < lower[0][i]) | static_cast<int>(upper[0][i] < x0) |
                 static_cast<int>(y1 < lower[1][i]) | static_cast<int>(upper[1][i] < y0) |
                 static_cast<int>(z1 < lower[2][i]) | static_cast<int>(upper[2][i] < z0) |
                 static_cast<int>(n.x * normal[0][i] + n.y * normal[1][i] + n.z * normal[2][i] >
                                  cosine_of_sheet);
    }
    for (std::size_t i = 0; i < size; ++i) {
      if (apart[i] == 0) visit(facets[i]);
    }
  }
};

/// Four boxes, so that another one is compared with all of them at once.
struct FourBoxes {
  std::array<FloatLanes, 3> lower{all_lanes(1e30F), all_lanes(1e30F), all_lanes(1e30F)};
  std::array<FloatLanes, 3> upper{all_lanes(-1e30F), all_lanes(-1e30F), all_lanes(-1e30F)};

  void put(std::size_t i, const RoundedBox& box) {
    for (int axis = 0; axis < 3; ++axis) {
      lower[axis][i] = box.lower[axis];
      upper[axis][i] = box.upper[axis];
    }
  }

  /// Around all of them.
  RoundedBox box() const {
    RoundedBox all;
    for (std::size_t i = 0; i < float_lanes; ++i) {
      all.add({{lower[0][i], lower[1][i], lower[2][i]}, {upper[0][i], upper[1][i], upper[2][i]}});
    }
    return all;
  }

  FloatMask meet(const RoundedBox& box) const {
    FloatMask apart{};
    for (int axis = 0; axis < 3; ++axis) {
      apart |=
          (upper[axis] < all_lanes(box.lower[axis])) | (all_lanes(box.upper[axis]) < lower[axis]);
    }
    return ~apart;
  }
};

/// The living facets in groups of neighbours, under a tree of boxes.
class FacetGroups {
 public:
  explicit FacetGroups(const CollapseMesh& mesh) {
    std::vector<std::uint32_t> facets;
    facets.reserve(std::size_t{2} * mesh.live_vertices);
    for (std::uint32_t f = 0; f < mesh.normals.size(); ++f) {
      if (mesh.topology.alive(f)) facets.push_back(f);
    }
    groups_.resize((facets.size() + Group::size - 1) / Group::size);
    constexpr std::size_t grain = 128;
    parallel_for(groups_.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t g = begin; g < end; ++g) {
        for (std::size_t i = 0; i < Group::size; ++i) {
          const std::size_t place = g * Group::size + i;
          const std::uint32_t f = place < facets.size() ? facets[place] : HalfEdges::none;
          if (f == HalfEdges::none) {
            groups_[g].put(i, f, {}, {});
          } else {
            groups_[g].put(i, f, rounded(box_of(mesh, f)), normalized(mesh.normals[f]));
          }
        }
        groups_[g].find_flat();
      }
    });
    sort_along_curve();
    for (const Group& group : groups_) boxes_.push_back(group.box());
    levels_.push_back(in_fours(boxes_));
    while (levels_.back().size() > 1) {
      std::vector<RoundedBox> boxes;
      for (const FourBoxes& four : levels_.back()) boxes.push_back(four.box());
      levels_.push_back(in_fours(boxes));
    }
  }

  std::size_t count() const { return groups_.size(); }
  const Group& group(std::size_t g) const { return groups_[g]; }
  const RoundedBox& box(std::size_t g) const { return boxes_[g]; }

  /// Calls visit(g) for the groups from `first` on whose boxes meet the given one, in order.
  template <class Visit>
  void for_each_meeting(const RoundedBox& box, std::size_t first, const Visit& visit) const {
    if (!groups_.empty()) look(levels_.size() - 1, 0, box, first, visit);
  }

 private:
  static constexpr int bits = 2;
  static constexpr std::size_t branching = 1U << bits;
  static_assert(branching == float_lanes);

  static std::vector<FourBoxes> in_fours(std::span<const RoundedBox> boxes) {
    std::vector<FourBoxes> fours((boxes.size() + branching - 1) / branching);
    for (std::size_t i = 0; i < boxes.size(); ++i) {
      fours[i / branching].put(i % branching, boxes[i]);
    }
    return fours;
  }

  /// Puts the groups along a Z curve (Morton 1966), so that each part of the row is compact.
  void sort_along_curve() {
    RoundedBox all;
    for (const Group& group : groups_) all.add(group.box());
    std::vector<std::pair<std::uint32_t, std::uint32_t>> keys(groups_.size());
    for (std::uint32_t g = 0; g < keys.size(); ++g) keys[g] = {all.curve(groups_[g].box()), g};
    std::sort(keys.begin(), keys.end());
    std::vector<Group> sorted;
    sorted.reserve(groups_.size());
    for (const auto& [key, g] : keys) sorted.push_back(groups_[g]);
    groups_ = std::move(sorted);
  }

  /// At what lies under four boxes of a level.
  template <class Visit>
  void look(std::size_t level, std::size_t four, const RoundedBox& box, std::size_t first,
            const Visit& visit) const {
    const FloatMask meet = levels_[level][four].meet(box);
    for (std::size_t i = 0; i < branching; ++i) {
      const std::size_t child = branching * four + i;
      if (meet[i] == 0 || ((child + 1) << (bits * level)) <= first) continue;
      if (level == 0) {
        visit(child);
      } else {
        look(level - 1, child, box, first, visit);
      }
    }
  }

  std::vector<Group> groups_;
  std::vector<RoundedBox> boxes_;               ///< of the groups
  std::vector<std::vector<FourBoxes>> levels_;  ///< of the groups, of four of those, and so on
};

/// Volume that three vectors span; 0 where rounding could have made it.
double volume(Vec3d a, Vec3d b, Vec3d c) {
  constexpr double rounding = 1e-14;
  const double v = dot(a, cross(b, c));
  return v * v <= rounding * rounding * dot(a, a) * dot(b, b) * dot(c, c) ? 0 : v;
}

struct Facet {
  std::uint32_t f;
  Triangle vertices;
  Corners corners;
  Vec3d normal;

  Facet(const CollapseMesh& mesh, std::uint32_t facet)
      : f(facet),
        vertices(vertices_of(mesh, facet)),
        corners{mesh.r[vertices[0]], mesh.r[vertices[1]], mesh.r[vertices[2]]},
        normal(mesh.normals[facet]) {}

  bool has(std::uint32_t v) const {
    return v == vertices[0] || v == vertices[1] || v == vertices[2];
  }

  /// Whether corners of another facet lie on both sides of the plane of this one; what they share
  /// lies in it.
  bool parts(const Facet& other) const {
    bool above = false;
    bool below = false;
    for (int i = 0; i < 3; ++i) {
      const double height = dot(other.corners[i] - corners[0], normal);
      const bool shared = has(other.vertices[i]);
      above |= !shared & (height > 0);
      below |= !shared & (height < 0);
    }
    return above && below;
  }
};

/// Adds the places where edges of f pass through the inside of g.
void add_places(const Facet& f, const Facet& g, Box& places) {
  const Corners& t = g.corners;
  std::array<double, 3> height;
  for (int i = 0; i < 3; ++i) {
    height[i] = g.has(f.vertices[i]) ? 0 : volume(f.corners[i] - t[0], t[1] - t[0], t[2] - t[0]);
  }
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    if (!(std::min(height[i], height[j]) < 0 && std::max(height[i], height[j]) > 0)) continue;
    const Vec3d r = f.corners[i];
    const Vec3d edge = f.corners[j] - r;
    const double a = volume(edge, t[0] - r, t[1] - r);
    const double b = volume(edge, t[1] - r, t[2] - r);
    const double c = volume(edge, t[2] - r, t[0] - r);
    if (std::min({a, b, c}) > 0 || std::max({a, b, c}) < 0) {
      places.add(r + height[i] / (height[i] - height[j]) * edge);
    }
  }
}

/// The crossings of the facets of a group with those that come after them.
void find_crossings(const CollapseMesh& mesh, const FacetGroups& groups, std::size_t a,
                    std::vector<Box>& found) {
  std::vector<std::size_t> around;
  groups.for_each_meeting(groups.box(a), a, [&](std::size_t b) {
    if (!groups.group(a).is_one_sheet_with(groups.group(b))) around.push_back(b);
  });
  if (around.empty()) return;
  for (std::size_t i = 0; i < groups.group(a).count(); ++i) {
    const Facet f(mesh, groups.group(a).facets[i]);
    const RoundedBox box = groups.group(a).box(i);
    const Vec3f n(normalized(f.normal));
    const auto cross = [&](const Facet& g) {
      if (!f.parts(g) || !g.parts(f)) return;
      Box places;
      add_places(f, g, places);
      add_places(g, f, places);
      if (places.lower.x <= places.upper.x) found.push_back(places);
    };
    for (const std::size_t b : around) {
      if (!groups.box(b).meets(box)) continue;
      groups.group(b).for_each_meeting(box, n, [&](std::uint32_t g) {
        if (b != a || g > f.f) cross(Facet(mesh, g));
      });
    }
  }
}

}  // namespace

std::vector<Box> crossings(const CollapseMesh& mesh) {
  constexpr std::size_t grain = 64;
  const FacetGroups groups(mesh);
  std::vector<std::vector<Box>> found((groups.count() + grain - 1) / grain);
  parallel_for(groups.count(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t a = begin; a < end; ++a) find_crossings(mesh, groups, a, found[a / grain]);
  });
  std::vector<Box> result;
  for (const std::vector<Box>& part : found) result.insert(result.end(), part.begin(), part.end());
  return result;
}

std::vector<std::uint32_t> facets_near(const CollapseMesh& mesh, std::span<const Box> boxes) {
  const FacetGroups groups(mesh);
  std::vector<std::uint32_t> result;
  for (const Box& exact : boxes) {
    const RoundedBox box = rounded(exact);
    groups.for_each_meeting(box, 0, [&](std::size_t g) {
      groups.group(g).for_each_meeting(box, [&](std::uint32_t f) { result.push_back(f); });
    });
  }
  std::sort(result.begin(), result.end());
  result.erase(std::unique(result.begin(), result.end()), result.end());
  return result;
}

}  // namespace scarp
