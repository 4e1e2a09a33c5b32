#include "flux/reconstruct.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <tuple>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"

namespace scarp {

namespace {

constexpr double least_cosine = 0.766;  // of 40 degrees
constexpr std::size_t grain = 512;      // vertices

using Corners = std::array<float, 3>;

// Means at the corners, sharpened.
//
// Means over the facets around a corner, and then over the corners of a facet, are a low pass A.
// Where a flux does more than rise steadily it is blurred: the bottom of a hole, on which ions come
// straight, goes too slowly, the more so the larger its facets are. So the means of what A lacks,
// F - A F, are added, which makes 2 A - A^2 of A: it blurs in the next order only, and raises no
// noise, since the spectrum of A is in [0, 1]. This comes to a flow between every two corners of a
// facet, from the lower to the higher, of a third of their difference. Flows can be limited so that
// no corner leaves the range of its facets, and what one gains another one loses.
// Source: twicing, Tukey 1977; the limits are those of Zalesak 1979.
class Sharpener {
 public:
  Sharpener(const SmoothCorners& corners, std::span<const float> facet_values)
      : mesh_(corners.mesh()), corners_(corners), facet_values_(facet_values) {}

  std::vector<Corners> values() {
    means_.resize(mesh_.triangles.size());
    for_each_corner([&](auto f, auto corner) { return std::tuple(mean(f, corner)); }, means_);
    takes_.resize(means_.size());
    gives_.resize(means_.size());
    for_each_corner([&](auto f, auto corner) { return limits(f, corner); }, takes_, gives_);
    std::vector<Corners> values(means_.size());
    for_each_corner([&](auto f, auto corner) { return std::tuple(sharpened(f, corner)); }, values);
    return values;
  }

 private:
  // Per area of a corner.
  struct Flow {
    double in = 0;
    double out = 0;
  };

  // Fills arrays with what use(f, corner) gives for each corner: once for all around a vertex where
  // they all count for each other.
  template <class Use, class... Arrays>
  void for_each_corner(const Use& use, Arrays&... arrays) const {
    parallel_for(mesh_.vertices.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t v = begin; v < end; ++v) {
        decltype(use(0, 0)) result;
        bool is_known = false;
        for (const std::uint32_t f : corners_.around(v)) {
          for (std::size_t corner = 0; corner < 3; ++corner) {
            if (mesh_.triangles[f][corner] != v) continue;
            if (!is_known) result = use(f, corner);
            is_known = corners_.is_smooth(v);
            std::tie(arrays[f][corner]...) = result;
          }
        }
      }
    });
  }

  std::size_t corner_at(std::uint32_t f, std::size_t v) const {
    const Triangle& triangle = mesh_.triangles[f];
    return triangle[0] == v ? 0 : triangle[1] == v ? 1 : 2;
  }

  float mean(std::uint32_t f, std::size_t corner) const {
    double sum = 0;
    double area = 0;
    corners_.for_each(f, corner, [&](std::uint32_t g, double area_of_g) {
      sum += area_of_g * static_cast<double>(facet_values_[g]);
      area += area_of_g;
    });
    return area > 0 ? static_cast<float>(sum / area) : facet_values_[f];
  }

  // Of the facets that count.
  std::pair<float, float> range(std::uint32_t f, std::size_t corner) const {
    std::pair range{facet_values_[f], facet_values_[f]};
    corners_.for_each(f, corner, [&](std::uint32_t g, double) {
      range.first = std::min(range.first, facet_values_[g]);
      range.second = std::max(range.second, facet_values_[g]);
    });
    return range;
  }

  // The parts of what would flow that a corner can take and give.
  std::tuple<float, float> limits(std::uint32_t f, std::size_t corner) const {
    const auto [least, greatest] = range(f, corner);
    const Flow flow = flow_to(f, corner, [](auto, auto, auto) { return 1.0; });
    const double mean = means_[f][corner];
    return {static_cast<float>(std::min(1.0, (greatest - mean) / flow.in)),
            static_cast<float>(std::min(1.0, (mean - least) / flow.out))};
  }

  float sharpened(std::uint32_t f, std::size_t corner) const {
    const Flow flow = flow_to(
        f, corner, [&](std::size_t g, std::size_t i, std::size_t j) { return part(g, i, j); });
    const auto [least, greatest] = range(f, corner);  // which rounding may leave
    return std::clamp(static_cast<float>(means_[f][corner] + flow.in - flow.out), least, greatest);
  }

  // Of the flow to corner i of a facet from its corner j.
  double part(std::size_t f, std::size_t i, std::size_t j) const {
    const bool is_higher = means_[f][i] > means_[f][j];
    return is_higher ? std::min(takes_[f][i], gives_[f][j]) : std::min(gives_[f][i], takes_[f][j]);
  }

  template <class Part>
  Flow flow_to(std::uint32_t f, std::size_t corner, const Part& part) const {
    const std::uint32_t v = mesh_.triangles[f][corner];
    Flow flow;
    double area = 0;
    corners_.for_each(f, corner, [&](std::uint32_t g, double area_of_g) {
      const std::size_t i = corner_at(g, v);
      for (std::size_t j = 0; j < 3; ++j) {
        const double third = (static_cast<double>(means_[g][i]) - means_[g][j]) / 3;
        if (third == 0) continue;
        (third > 0 ? flow.in : flow.out) += area_of_g * std::abs(third) * part(g, i, j);
      }
      area += area_of_g;
    });
    if (!(area > 0)) return {};
    return {flow.in / area, flow.out / area};
  }

  const TriMesh& mesh_;
  const SmoothCorners& corners_;
  std::span<const float> facet_values_;
  std::vector<Corners> means_;
  std::vector<Corners> takes_;
  std::vector<Corners> gives_;
};

}  // namespace

SmoothCorners::SmoothCorners(const TriMesh& mesh)
    : mesh_(mesh),
      first_(mesh.vertices.size() + 1),
      areas_(facet_areas(mesh)),
      normals_(facet_normals(mesh)) {
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) ++first_[v + 1];
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) first_[v + 1] += first_[v];
  around_.resize(first_.back());
  std::vector<std::uint32_t> next(first_.begin(), first_.end() - 1);
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f)
    for (const std::uint32_t v : mesh.triangles[f]) around_[next[v]++] = f;
  is_smooth_.resize(mesh.vertices.size());
  for (std::size_t v = 0; v < is_smooth_.size(); ++v) is_smooth_[v] = all_belong(v) ? 1 : 0;
}

bool SmoothCorners::all_belong(std::size_t v) const {
  const auto facets = around(v);
  double area = 0;
  for (std::size_t a = 0; a < facets.size(); ++a) {
    area += areas_[facets[a]];
    for (std::size_t b = 0; b < a; ++b)
      if (!belongs(facets[a], facets[b])) return false;
  }
  return area > 0;
}

bool SmoothCorners::belongs(std::uint32_t f, std::uint32_t g) const {
  if (!mesh_.materials.empty() && mesh_.materials[f] != mesh_.materials[g]) return false;
  return f == g || dot(Vec3d(normals_[f]), Vec3d(normals_[g])) > least_cosine;
}

std::vector<std::array<float, 3>> corner_values(const SmoothCorners& corners,
                                                std::span<const float> facet_values) {
  SCARP_ASSERT(facet_values.size(), ==, corners.mesh().triangles.size());
  return Sharpener(corners, facet_values).values();
}

}  // namespace scarp
