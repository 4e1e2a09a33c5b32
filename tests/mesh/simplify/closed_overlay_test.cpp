#include "mesh/simplify/closed_overlay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

#include "core/random.h"
#include "tests/mesh/generated_surface.h"

namespace scarp {
namespace {

/// A triangle as a height field over x and y.
struct Slope {
  Vec3d a, b, c;

  /// Its height at a place; nothing beside it.
  std::optional<double> height(double x, double y) const {
    const auto area = [](Vec3d p, Vec3d q, double px, double py) {
      return (q.x - p.x) * (py - p.y) - (q.y - p.y) * (px - p.x);
    };
    const double of_a = area(b, c, x, y);
    const double of_b = area(c, a, x, y);
    const double of_c = area(a, b, x, y);
    if (std::min({of_a, of_b, of_c}) < 0) return {};
    return (of_a * a.z + of_b * b.z + of_c * c.z) / (of_a + of_b + of_c);
  }
};

struct Change {
  const CollapseMesh& mesh;
  const Star& star;
  Vec3d r;

  Slope new_facet(int i) const { return {r, mesh.r[star.ring[i]], mesh.r[star.ring[i + 1]]}; }
  std::vector<Slope> old_facets() const {
    std::vector<Slope> slopes;
    for (int i = 0; i < star.count; ++i) {
      slopes.push_back({mesh.r[star.at_target[i] ? star.v : star.u], mesh.r[star.ring[i]],
                        mesh.r[star.ring[i + 1]]});
    }
    for (int i = 0; i < star.dying_count(); ++i) {
      const std::uint32_t h = 3 * star.dying[i];
      slopes.push_back({mesh.r[mesh.topology.origin(h)], mesh.r[mesh.topology.origin(h + 1)],
                        mesh.r[mesh.topology.origin(h + 2)]});
    }
    return slopes;
  }
};

/// What samples of a facet after the change say: the greatest height difference, and number of an
/// old facet that it meets.
std::array<double, 2> sampled(const Change& change, int i, std::span<const double> old_error) {
  const Slope facet = change.new_facet(i);
  const std::vector<Slope> old_facets = change.old_facets();
  double difference = 0;
  double error = 0;
  constexpr int steps = 40;
  for (int j = 0; j <= steps; ++j) {
    for (int k = 0; k <= steps - j; ++k) {
      const double of_b = 1.0 * j / steps;
      const double of_c = 1.0 * k / steps;
      const Vec3d p = facet.a + of_b * (facet.b - facet.a) + of_c * (facet.c - facet.a);
      for (std::size_t old = 0; old < old_facets.size(); ++old) {
        const std::optional<double> height = old_facets[old].height(p.x, p.y);
        if (!height) continue;
        difference = std::max(difference, std::abs(*height - p.z));
        error = std::max(error, old_error[old]);
      }
    }
  }
  return {difference, error};
}

/// Compares the overlay of a star with samples of it.
void expect_as_sampled(const CollapseMesh& mesh, const Star& star, Vec3d r, RandomStream& random,
                       int& count) {
  ClosedOverlay overlay;
  if (!overlay.lay(mesh, star, r, {0, 0, 1})) return;
  ++count;
  std::array<double, ClosedOverlay::capacity + 2> none{};
  std::array<double, ClosedOverlay::capacity> difference{};
  overlay.bound(none, difference);
  std::array<double, ClosedOverlay::capacity + 2> old_error{};
  for (int i = 0; i < star.count + star.dying_count(); ++i) old_error[i] = random.uniform();
  std::array<double, ClosedOverlay::capacity> proposed{};
  overlay.bound(old_error, proposed);
  double largest = 0;
  double largest_sampled = 0;
  for (int i = 0; i < star.count; ++i) {
    const auto [height, error] = sampled({mesh, star, r}, i, old_error);
    EXPECT_GE(difference[i], height - 1e-9) << "facet " << i;
    EXPECT_GE(proposed[i] - difference[i], error - 1e-9) << "facet " << i;
    largest = std::max(largest, difference[i]);
    largest_sampled = std::max(largest_sampled, height);
  }
  EXPECT_LT(largest, 1.15 * largest_sampled + 1e-3);
}

TEST(ClosedOverlay, OfAnEdgeIsNoLessThanSamplesAndHardlyMore) {
  const CollapseMesh mesh(noisy_plane(12, 0.05, 3), {});
  RandomStream random({.seed = 1});
  int count = 0;
  for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); h += 5) {
    const std::uint32_t u = mesh.topology.origin(h);
    const std::uint32_t v = mesh.topology.target(h);
    if (mesh.topology.on_boundary(u) || mesh.topology.on_boundary(v)) continue;
    Star star;
    ASSERT_GT(star.gather_closed(mesh.topology, h), 0);
    const Vec3d shift{0.3 * random.uniform(), 0.3 * random.uniform(), 0.3 * random.uniform()};
    expect_as_sampled(mesh, star, 0.5 * (mesh.r[u] + mesh.r[v]) + shift, random, count);
  }
  EXPECT_GT(count, 50);
}

TEST(ClosedOverlay, OfAVertexIsNoLessThanSamplesAndHardlyMore) {
  const CollapseMesh mesh(noisy_plane(12, 0.05, 3), {});
  RandomStream random({.seed = 2});
  int count = 0;
  for (std::uint32_t v = 0; v < mesh.r.size(); ++v) {
    if (mesh.topology.outgoing(v) == HalfEdges::none || mesh.topology.on_boundary(v)) continue;
    Star star;
    ASSERT_TRUE(star.gather_vertex(mesh.topology, v));
    const Vec3d shift{0.3 * random.uniform(), 0.3 * random.uniform(), 0.3 * random.uniform()};
    expect_as_sampled(mesh, star, mesh.r[v] + shift, random, count);
  }
  EXPECT_GT(count, 50);
}

TEST(ClosedOverlay, RefusesWhatIsNoHeightField) {
  const CollapseMesh mesh(noisy_plane(6, 0), {});
  for (std::uint32_t h = 0; h < mesh.topology.half_edge_count(); ++h) {
    const std::uint32_t u = mesh.topology.origin(h);
    const std::uint32_t v = mesh.topology.target(h);
    if (mesh.topology.on_boundary(u) || mesh.topology.on_boundary(v)) continue;
    Star star;
    ASSERT_GT(star.gather_closed(mesh.topology, h), 0);
    ClosedOverlay overlay;
    EXPECT_TRUE(overlay.lay(mesh, star, mesh.r[u], {0, 0, 1}));
    EXPECT_FALSE(overlay.lay(mesh, star, mesh.r[u] + Vec3d{3, 0, 0}, {0, 0, 1}));
    EXPECT_FALSE(overlay.lay(mesh, star, mesh.r[u], {0, 0, -1}));
  }
}

}  // namespace
}  // namespace scarp
