#include "flux/reconstruct.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "core/smooth_edge.h"
#include "core/vector_kernel.h"

namespace scarp {

namespace {

constexpr std::size_t grain = 1024;  // facets or sets of corners

using Corners = std::array<float, 3>;

// Which facets count for each other around vertices.
class Smoothness {
 public:
  explicit Smoothness(const TriMesh& mesh) : mesh_(mesh), normals_(facet_normals(mesh)) {}

  bool belongs(std::uint32_t f, std::uint32_t g) const {
    if (!mesh_.materials.empty() && mesh_.materials[f] != mesh_.materials[g]) return false;
    return f == g || dot(Vec3d(normals_[f]), Vec3d(normals_[g])) > smooth_cosine;
  }
  bool all_belong(std::span<const SmoothCorners::Member> around) const {
    for (std::size_t a = 0; a < around.size(); ++a)
      for (std::size_t b = 0; b < a; ++b)
        if (!belongs(around[a].facet, around[b].facet)) return false;
    return true;
  }

 private:
  const TriMesh& mesh_;
  std::vector<Vec3f> normals_;
};

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
      : corners_(corners), facet_values_(facet_values), ends_(corners.set_count()) {}

  std::vector<Corners> values() {
    std::vector<Flows> flows(facet_values_.size());
    for_each(ends_, [&](std::size_t set) { return ends_of(set); });
    for_each(flows, [&](std::size_t f) { return wanted_flows(f); });
    for_each(ends_, [&](std::size_t set) { return with_limits(set, flows); });
    for_each(flows, [&](std::size_t f) { return limited_flows(f); });
    for_each(ends_, [&](std::size_t set) { return with_value(set, flows); });
    std::vector<Corners> values(facet_values_.size());
    for_each(values, [&](std::size_t f) {
      const auto& [a, b, c] = corners_.sets_of(f);
      return Corners{ends_[a].value, ends_[b].value, ends_[c].value};
    });
    return values;
  }

 private:
  // A set of corners between which and others there are flows.
  struct End {
    float mean = 0;
    float least = 0;  // of the facets that count
    float greatest = 0;
    float takes = 0;  // the parts of what would flow that it can take and give
    float gives = 0;
    float value = 0;
  };
  // What flows to the corners of a facet and from them, per area of theirs.
  struct Flows {
    std::array<double, 3> in{};
    std::array<double, 3> out{};
  };

  template <class T, class Use>
  static void for_each(std::vector<T>& all, const Use& use) {
    parallel_for(all.size(), grain, [&](std::size_t begin, std::size_t end) {
      for (std::size_t n = begin; n < end; ++n) all[n] = use(n);
    });
  }

  End ends_of(std::size_t set) const {
    const auto members = corners_.members(set);
    End end{.least = facet_values_[members[0].facet], .greatest = facet_values_[members[0].facet]};
    double mean = 0;
    for (const auto& [facet, corner, part] : members) {
      const float value = facet_values_[facet];
      mean += part * static_cast<double>(value);
      end.least = std::min(end.least, value);
      end.greatest = std::max(end.greatest, value);
    }
    end.mean = static_cast<float>(mean);
    return end;
  }

  // Of each flow between two corners what part(higher, lower) lets through. Without branches: which
  // of two is higher is as good as random.
  template <class Part>
  Flows flows(std::size_t f, const Part& part) const {
    const auto& sets = corners_.sets_of(f);
    Flows flows;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3;
      const std::array<const End*, 2> ends{&ends_[sets[j]], &ends_[sets[i]]};
      const double third = (static_cast<double>(ends[1]->mean) - ends[0]->mean) / 3;
      const bool to_i = third > 0;
      const double flow = std::abs(third) * part(*ends[to_i ? 1 : 0], *ends[to_i ? 0 : 1]);
      const double in_i = select(to_i, flow, 0.0);
      const double in_j = select(to_i, 0.0, flow);
      flows.in[i] += in_i;
      flows.in[j] += in_j;
      flows.out[j] += in_i;
      flows.out[i] += in_j;
    }
    return flows;
  }
  Flows wanted_flows(std::size_t f) const {
    return flows(f, [](const End&, const End&) { return 1.0; });
  }
  Flows limited_flows(std::size_t f) const {
    return flows(f, [](const End& higher, const End& lower) {
      return static_cast<double>(std::min(higher.takes, lower.gives));
    });
  }

  End with_limits(std::size_t set, const std::vector<Flows>& flows) const {
    End end = ends_[set];
    const auto [in, out] = sum_at(set, flows);
    const double mean = end.mean;
    if (in > 0) end.takes = static_cast<float>(std::min(1.0, (end.greatest - mean) / in));
    if (out > 0) end.gives = static_cast<float>(std::min(1.0, (mean - end.least) / out));
    return end;
  }

  End with_value(std::size_t set, const std::vector<Flows>& flows) const {
    End end = ends_[set];
    const auto [in, out] = sum_at(set, flows);
    // Rounding may leave the range.
    end.value = std::clamp(static_cast<float>(end.mean + in - out), end.least, end.greatest);
    return end;
  }

  std::pair<double, double> sum_at(std::size_t set, const std::vector<Flows>& flows) const {
    std::pair<double, double> sum;
    for (const auto& [facet, corner, part] : corners_.members(set)) {
      sum.first += part * flows[facet].in[corner];
      sum.second += part * flows[facet].out[corner];
    }
    return sum;
  }

  const SmoothCorners& corners_;
  std::span<const float> facet_values_;
  std::vector<End> ends_;
};

}  // namespace

SmoothCorners::SmoothCorners(const TriMesh& mesh)
    : mesh_(mesh), sets_(mesh.triangles.size()), first_{0} {
  const std::vector<double> areas = facet_areas(mesh);
  const Smoothness smoothness(mesh);
  // Of the facets around each vertex.
  std::vector<std::uint32_t> first(mesh.vertices.size() + 1);
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t v : t) ++first[v + 1];
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) first[v + 1] += first[v];
  std::vector<Member> all(first.back());
  std::vector<std::uint32_t> next(first.begin(), first.end() - 1);
  for (std::uint32_t f = 0; f < mesh.triangles.size(); ++f)
    for (std::uint32_t corner = 0; corner < 3; ++corner)
      all[next[mesh.triangles[f][corner]]++] = {f, corner, areas[f]};

  const auto add_set = [&](std::span<const Member> around, const auto& counts) {
    double area = 0;
    for (const Member& each : around) {
      if (!counts(each)) continue;
      members_.push_back(each);
      area += each.part;
    }
    const auto added = std::span(members_).subspan(first_.back());
    // A facet without area counts for itself alone.
    for (Member& each : added) each.part = area > 0 ? each.part / area : 1;
    first_.push_back(static_cast<std::uint32_t>(members_.size()));
    return static_cast<std::uint32_t>(set_count() - 1);
  };
  members_.reserve(all.size());
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
    const auto around = std::span(all).subspan(first[v], first[v + 1] - first[v]);
    if (around.empty()) continue;
    if (smoothness.all_belong(around)) {
      const std::uint32_t set = add_set(around, [](const Member&) { return true; });
      for (const Member& each : around) sets_[each.facet][each.corner] = set;
      continue;
    }
    for (const Member& each : around) {
      sets_[each.facet][each.corner] = add_set(
          around, [&](const Member& other) { return smoothness.belongs(each.facet, other.facet); });
    }
  }
}

std::vector<std::array<float, 3>> corner_values(const SmoothCorners& corners,
                                                std::span<const float> facet_values) {
  SCARP_ASSERT(facet_values.size(), ==, corners.mesh().triangles.size());
  return Sharpener(corners, facet_values).values();
}

}  // namespace scarp
