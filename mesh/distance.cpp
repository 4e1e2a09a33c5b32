#include "mesh/distance.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <tuple>

#include "core/error.h"
#include "core/parallel.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 1024;

void check(const TriMesh& mesh) {
  if (mesh.triangles.empty()) throw InputError("distance: a mesh has no triangles");
}

/// The distance to one facet is greatest at a corner, as facets are convex: so no point of a
/// triangle is further away than its corners are from any one facet of the other mesh.
class ProvenDistance {
 public:
  ProvenDistance(const TriMesh& from, const TriMesh& to, double slack)
      : to_(to), tree_(to), slack_(slack) {
    // The nearer this comes to the end, the fewer facets have to be cut.
    found_ = statistics(distances(surface_vertices(from), tree_)).max;
    parts_left_ = more_parts + parts_per_facet * from.triangles.size();
  }

  void add(const std::array<Vec3d, 3>& triangle, int cuts = most_cuts) {
    const auto& [a, b, c] = triangle;
    double proven = std::numeric_limits<double>::infinity();
    for (const Vec3d r : {a, b, c, (a + b + c) / 3.0}) {
      const ClosestPoint closest = tree_.closest(r);
      found_ = std::max(found_, closest.distance);
      const std::array<Vec3d, 3> facet = corners(to_, closest.triangle);
      double farthest = 0;
      for (const Vec3d corner : triangle)
        farthest = std::max(farthest, closest_on_triangle(corner, facet).distance);
      proven = std::min(proven, farthest);
    }
    constexpr std::size_t quarters = 4;
    if (proven <= found_ + slack_ || cuts == 0 || parts_left_ < quarters) {
      proven_ = std::max(proven_, proven);
      return;
    }
    parts_left_ -= quarters;
    const Vec3d ab = 0.5 * (a + b);
    const Vec3d bc = 0.5 * (b + c);
    const Vec3d ca = 0.5 * (c + a);
    for (const std::array<Vec3d, 3>& part : {std::array{a, ab, ca}, std::array{ab, b, bc},
                                             std::array{ca, bc, c}, std::array{ab, bc, ca}})
      add(part, cuts - 1);
  }

  double proven() const { return proven_; }

 private:
  static constexpr int most_cuts = 10;
  /// Slivers that cross an edge all along would be cut to pieces as short as they are narrow: two
  /// seconds of it are enough.
  static constexpr std::size_t more_parts = 600000;
  static constexpr std::size_t parts_per_facet = 64;

  const TriMesh& to_;
  TriangleTree tree_;
  double slack_;
  double found_ = 0;
  double proven_ = 0;
  std::size_t parts_left_ = 0;
};

}  // namespace

double proven_distance(const TriMesh& from, const TriMesh& to, double slack) {
  check(from);
  check(to);
  ProvenDistance distance(from, to, slack);
  for (std::size_t f = 0; f < from.triangles.size(); ++f) distance.add(corners(from, f));
  return distance.proven();
}

std::vector<double> distances(std::span<const Vec3d> places, const TriangleTree& to) {
  std::vector<double> result(places.size());
  parallel_for(places.size(), grain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) result[i] = to.closest(places[i]).distance;
  });
  return result;
}

std::vector<Vec3d> surface_vertices(const TriMesh& mesh) {
  std::vector<bool> used(mesh.vertices.size(), false);
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) used[v] = true;
  }
  std::vector<Vec3d> places;
  places.reserve(used.size());
  for (std::size_t v = 0; v < used.size(); ++v) {
    if (used[v]) places.emplace_back(mesh.vertices[v]);
  }
  return places;
}

std::vector<Vec3d> surface_samples(const TriMesh& mesh, double spacing) {
  std::vector<Vec3d> places;
  for (std::size_t f = 0; f < mesh.triangles.size(); ++f) {
    auto [a, b, c] = corners(mesh, f);
    for (int turn = 0; turn < 2; ++turn) {
      if (length(b - a) < std::max(length(c - b), length(a - c)))
        std::tie(a, b, c) = std::tuple(b, c, a);
    }
    // In rows along the longest edge, of which the next lower one covers every place.
    const double longest = length(b - a);
    const double height = longest > 0 ? length(cross(b - a, c - a)) / longest : 0;
    const auto parts = [](double distance, double most) {
      return std::max(1, static_cast<int>(std::ceil(distance / most)));
    };
    const int rows = parts(height, 0.7 * spacing);
    for (int j = 0; j <= rows; ++j) {
      const double t = static_cast<double>(j) / rows;
      const Vec3d first = a + t * (c - a);
      const Vec3d last = b + t * (c - b);
      const int n = parts((1 - t) * longest, 1.4 * spacing);
      for (int i = 0; i <= n; ++i)
        places.push_back(first + (static_cast<double>(i) / n) * (last - first));
    }
  }
  return places;
}

DistanceStatistics statistics(std::span<const double> distances) {
  DistanceStatistics result;
  if (distances.empty()) return result;
  double sum = 0;
  double squares = 0;
  for (const double d : distances) {
    result.max = std::max(result.max, d);
    sum += d;
    squares += d * d;
  }
  const auto count = static_cast<double>(distances.size());
  result.mean = sum / count;
  result.rms = std::sqrt(squares / count);
  std::vector<double> sorted(distances.begin(), distances.end());
  const auto place = sorted.begin() + static_cast<std::ptrdiff_t>(0.99 * (count - 1));
  std::nth_element(sorted.begin(), place, sorted.end());
  result.p99 = *place;
  return result;
}

SurfaceDistance surface_distance(const TriMesh& a, const TriMesh& b, double spacing) {
  check(a);
  check(b);
  const auto places = [spacing](const TriMesh& mesh) {
    return spacing > 0 ? surface_samples(mesh, spacing) : surface_vertices(mesh);
  };
  SurfaceDistance result;
  result.forward = statistics(distances(places(a), TriangleTree(b)));
  result.reverse = statistics(distances(places(b), TriangleTree(a)));
  result.symmetric_max = std::max(result.forward.max, result.reverse.max);
  return result;
}

}  // namespace scarp
