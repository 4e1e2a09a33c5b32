#include "mesh/simplify/collapse.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "mesh/simplify/pass_star.h"

namespace scarp {
namespace {

/// Turned about y, from up towards +x.
Vec3d turned(Vec3d n, double degrees) {
  const double angle = degrees * std::numbers::pi / 180;
  const double c = std::cos(angle);
  const double s = std::sin(angle);
  return {n.x * c + n.z * s, n.y, n.z * c - n.x * s};
}

/// A grid of unit squares, each cut along a diagonal, that falls off on both sides of x = 0.
TriMesh roof_mesh(double degrees) {
  constexpr int half = 3;
  constexpr int nodes = 2 * half + 1;
  const double slope = std::tan(degrees * std::numbers::pi / 180);
  TriMesh mesh;
  for (int j = -half; j <= half; ++j)
    for (int i = -half; i <= half; ++i)
      mesh.vertices.push_back(Vec3f(Vec3d{1.0 * i, 1.0 * j, -slope * std::abs(i)}));
  for (std::uint32_t j = 0; j + 1 < nodes; ++j) {
    for (std::uint32_t i = 0; i + 1 < nodes; ++i) {
      const std::uint32_t v = nodes * j + i;
      mesh.triangles.push_back({v, v + 1, v + nodes + 1});
      mesh.triangles.push_back({v, v + nodes + 1, v + nodes});
    }
  }
  return mesh;
}

/// The edge of a roof from (0, 0) to (0, 1), collapsed to a place. What the facets around were, and
/// how they faced in the input, is what they become, until a test says otherwise.
class Roof {
 public:
  explicit Roof(double degrees, Vec3d place = {0, 0.5, 0}, ThinFacets thin = ThinFacets::noisy)
      : mesh_(roof_mesh(degrees), {}, thin), checks_(mesh_, {}, 1), place_(place - mesh_.centre) {
    while (!is_at(mesh_.topology.origin(h_), {0, 0}) || !is_at(mesh_.topology.target(h_), {0, 1}))
      ++h_;
    EXPECT_TRUE(checks_.gather(mesh_, h_, place_));
    for (int i = 0; i < star().count; ++i) {
      mesh_.normals[star().facet[i]] = now(i);
      mesh_.input_normals[star().facet[i]] = CoarseDirection(now(i));
    }
  }

  const Star& star() const { return checks_.star(); }
  /// The facet of the star on the side of the ring from a place to the next.
  int facet(std::array<double, 2> from, std::array<double, 2> to) const {
    int i = 0;
    while (!is_at(star().ring[i], from) || !is_at(star().ring[i + 1], to)) ++i;
    return i;
  }
  /// Twice the area vector of a facet after the collapse.
  Vec3d now(int i) const { return checks_.normals()[static_cast<std::size_t>(i)]; }
  void set_before(int i, Vec3d n) { mesh_.normals[star().facet[i]] = n; }
  /// As thin: twice the area over the square of the longest edge.
  void set_before(int i, double thin, Vec3d direction) {
    const Vec3d a = mesh_.r[star().at_target[i] ? star().v : star().u];
    const Vec3d b = mesh_.r[star().ring[i]];
    const Vec3d c = mesh_.r[star().ring[i + 1]];
    const double longest = std::max({dot(b - a, b - a), dot(c - b, c - b), dot(a - c, a - c)});
    set_before(i, thin * longest * normalized(direction));
  }
  void set_input(int i, Vec3d n) { mesh_.input_normals[star().facet[i]] = CoarseDirection(n); }
  void set_beyond(int i, Vec3d n) {
    mesh_.normals[HalfEdges::facet(mesh_.topology.opposite(star().rim[i]))] = n;
  }

  /// The checks of all methods; those of passes have to agree.
  bool may_go() {
    const bool allowed = checks_.gather(mesh_, h_, place_) && checks_.keeps_surface(mesh_, h_);
    const FloatMesh floats(mesh_);
    PassStar pass;
    EXPECT_TRUE(pass.gather(mesh_.topology, h_));
    pass.place_at(floats, floats.place(place_));
    EXPECT_EQ(pass.keeps_facets(mesh_) && pass.makes_no_fold(mesh_, floats), allowed);
    return allowed;
  }

 private:
  bool is_at(std::uint32_t v, std::array<double, 2> place) const {
    const Vec3d r = mesh_.r[v] + mesh_.centre;
    return r.x == place[0] && r.y == place[1];
  }

  CollapseMesh mesh_;
  CollapseChecks checks_;
  Vec3d place_;
  std::uint32_t h_ = 0;
};

TEST(CollapseChecks, NoFacetTurnsByMoreThanSixtyDegrees) {
  for (const double degrees : {-61, -59, 59, 61}) {
    Roof roof(0);
    roof.set_before(2, turned(roof.now(2), degrees));
    EXPECT_EQ(roof.may_go(), std::abs(degrees) < 60) << degrees;
  }
}

// 40 degrees against the input; 45.6 if no facet around faces more than 72.5 degrees away.
TEST(CollapseChecks, ManyTurnsTogetherAreLimitedByTheInput) {
  const auto may_go = [](double here, double beyond) {
    Roof roof(30);
    const int left = roof.facet({-1, 1}, {-1, 0});
    const int right = roof.facet({1, 0}, {1, 1});
    roof.set_input(left, turned(roof.now(left), -here));
    roof.set_input(right, turned(roof.now(right), beyond));  // 60 degrees from the left already
    return roof.may_go();
  };
  EXPECT_TRUE(may_go(38, 16));
  EXPECT_FALSE(may_go(42, 16));
  EXPECT_FALSE(may_go(42, 14));
  EXPECT_TRUE(may_go(42, 11));
  EXPECT_TRUE(may_go(44, 0));
  EXPECT_FALSE(may_go(47, 0));
}

// What was a needle may have faced anywhere.
TEST(CollapseChecks, NeedlesAreComparedWithWhatIsAround) {
  const auto may_go = [](double thin, double around) {
    Roof roof(30);
    const int left = roof.facet({-1, 1}, {-1, 0});
    const int right = roof.facet({1, 0}, {1, 1});
    roof.set_before(left, thin, -1.0 * roof.now(left));
    roof.set_before(right, 1e4 * turned(roof.now(left), around));  // the mean of all
    return roof.may_go();
  };
  EXPECT_TRUE(may_go(0.049, 70));
  EXPECT_FALSE(may_go(0.051, 70));
  EXPECT_TRUE(may_go(0.01, 78));
  EXPECT_FALSE(may_go(0.01, 79));
}

/// Edges collapsed to a place beside the side of the ring at x = -1. The facet of its lower part
/// becomes the thinnest: twice its area over the square of its longest edge is `thin`.
Roof roof_with_thin_facet(double thin, double degrees = 0, ThinFacets facets = ThinFacets::noisy) {
  double beside = 0;
  for (int n = 0; n < 100; ++n) beside = thin * (2.25 + beside * beside);
  const double angle = degrees * std::numbers::pi / 180;
  const double x = -1 + beside * std::cos(angle);
  return Roof(degrees, {x, 0.5, std::tan(angle) * x}, facets);
}

TEST(CollapseChecks, SliversFaceAsWhatIsAround) {
  const auto may_go = [](double thin, double around, ThinFacets facets) {
    Roof roof = roof_with_thin_facet(thin, 25, facets);
    const Vec3d left = roof.now(roof.facet({-1, 0}, {-1, -1}));
    roof.set_before(roof.facet({1, 0}, {1, 1}), 1e4 * turned(left, around));  // the mean of all
    return roof.may_go();
  };
  EXPECT_TRUE(may_go(0.21, 61, ThinFacets::noisy));
  EXPECT_FALSE(may_go(0.19, 61, ThinFacets::noisy));
  EXPECT_TRUE(may_go(0.19, 59, ThinFacets::noisy));
  EXPECT_TRUE(may_go(0.19, 61, ThinFacets::exact));
}

TEST(CollapseChecks, ThinFacetsGetNoThinner) {
  const auto may_go = [](double thin, double before, ThinFacets facets = ThinFacets::noisy) {
    Roof roof = roof_with_thin_facet(thin, 0, facets);
    const int thinnest = roof.facet({-1, 0}, {-1, -1});
    roof.set_before(thinnest, before, roof.now(thinnest));
    return roof.may_go();
  };
  EXPECT_TRUE(may_go(1.1e-3, 0.01));
  EXPECT_FALSE(may_go(0.9e-3, 0.01));
  EXPECT_TRUE(may_go(0.5e-3, 0.49e-3));
  EXPECT_FALSE(may_go(0.5e-3, 0.51e-3));
  // Along drawn edges all are as thin but for rounding: down to 0.9 of it.
  EXPECT_TRUE(may_go(0.5e-3, 0.54e-3, ThinFacets::exact));
  EXPECT_FALSE(may_go(0.5e-3, 0.57e-3, ThinFacets::exact));
}

TEST(CollapseChecks, NoFacetLosesItsAreaHoweverThinItWas) {
  for (const double thin : {0.9e-5, 1.1e-5}) {
    Roof roof = roof_with_thin_facet(thin);
    for (const int i : {roof.facet({-1, 1}, {-1, 0}), roof.facet({-1, 0}, {-1, -1})})
      roof.set_before(i, 1e-7, roof.now(i));
    EXPECT_EQ(roof.may_go(), thin > 1e-5) << thin;
  }
}

// Beyond 107.5 degrees between neighbours.
TEST(CollapseChecks, NoFoldIsMadeOrSharpened) {
  const auto may_go_beside = [](double beyond, double before) {
    Roof roof(0);
    const int i = roof.facet({1, 0}, {1, 1});
    roof.set_beyond(i, turned(roof.now(i), beyond));
    roof.set_before(i, turned(roof.now(i), -before));
    return roof.may_go();
  };
  EXPECT_TRUE(may_go_beside(106, 0));
  EXPECT_FALSE(may_go_beside(109, -5)) << "was 104";
  EXPECT_TRUE(may_go_beside(109, 5)) << "was 114";
  EXPECT_FALSE(may_go_beside(109, -40)) << "was none";

  const auto may_go_within = [](double degrees, double before) {
    Roof roof(degrees);
    for (int i = 0; i < roof.star().count; ++i)
      roof.set_before(i, turned(roof.now(i), roof.now(i).x > 0 ? before : -before));
    return roof.may_go();
  };
  EXPECT_TRUE(may_go_within(53, -5));
  EXPECT_FALSE(may_go_within(54.5, -5));
  EXPECT_TRUE(may_go_within(54.5, 5));
}

TEST(CollapseChecks, MovesOfVerticesTurnFacetsByLittle) {
  const CollapseMesh mesh(roof_mesh(0), {});
  CollapseChecks checks(mesh, {}, 1);
  std::uint32_t v = 0;
  while (mesh.topology.on_boundary(v)) ++v;
  ASSERT_TRUE(checks.gather_vertex(mesh, v));
  for (const double degrees : {29.0, 30.0}) {
    std::vector<Vec3d> reference(mesh.normals.begin(), mesh.normals.end());
    reference[checks.star().facet[1]] = turned({0, 0, 1}, degrees);
    EXPECT_EQ(checks.may_move(mesh, mesh.r[v], reference), degrees < 29.5) << degrees;
  }
}

}  // namespace
}  // namespace scarp
