#include "flux/half_differences.h"

#include <array>

#include "core/parallel.h"

namespace scarp {

namespace {

// What one set of an element's rays tells of all that it sees.
struct Told {
  double flux = 0;
  double out = 0;
  double lost = 0;
};

// What a set lacks it takes from the other, as the rows of the matrix do.
// Shape: direct, the sums of weights of the sets.
std::array<Told, set_count> told_by_sets(const View& view, std::size_t row,
                                         std::span<const float> direct,
                                         const Radiosity& radiosity) {
  const ExchangeMatrix& matrix = view.matrix;
  std::array<Told, set_count> others{};
  std::array<double, set_count> to_sky_beyond{};  // that leaves more than the mean
  const auto rays = matrix.row(row);
  const auto places = std::span(view.places).subspan(matrix.first[row], rays.size());
  for (std::size_t k = 0; k < rays.size(); ++k) {
    const auto weight = static_cast<double>(rays[k].weight);
    const std::uint32_t hit = rays[k].hit;
    if (hit < matrix.size()) {
      others[k % set_count].flux +=
          weight * (radiosity.leaves(hit) + dot(radiosity.slopes()[hit], Vec3d(places[k])));
    } else if (hit != matrix.size() + to_sky) {
      others[k % set_count].out += weight;
    } else {
      to_sky_beyond[k % set_count] += weight * dot(radiosity.slopes()[row], Vec3d(places[k]));
    }
  }
  const SetSums& sums = view.sums[row];
  const double per_ray = static_cast<double>(set_count) / static_cast<double>(rays.size());
  std::array<Told, set_count> told{};
  for (std::size_t set = 0; set < set_count; ++set) {
    const std::size_t other = 1 - set;
    const double lacking = sums[other].others > 0 ? sums[set].lacking / sums[other].others : 0;
    told[set] = {.flux = per_ray * (static_cast<double>(direct[set]) + others[set].flux +
                                    lacking * others[other].flux),
                 .out = per_ray * (sums[set].sky + others[set].out + lacking * others[other].out)};
    told[set].lost = radiosity.leaves(row) * told[set].out + per_ray * to_sky_beyond[set];
  }
  return told;
}

}  // namespace

HalfDifferences half_differences(const View& view, std::span<const float> direct,
                                 const Radiosity& radiosity) {
  static_assert(set_count == 2);
  const ExchangeMatrix& matrix = view.matrix;
  HalfDifferences halves{std::vector<double>(matrix.size()), std::vector<double>(matrix.size()),
                         std::vector<double>(matrix.size())};
  parallel_for(matrix.size(), 512, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto told = told_by_sets(view, i, direct.subspan(i * set_count, set_count), radiosity);
      halves.flux[i] = (told[0].flux - told[1].flux) / 2;
      halves.out[i] = (told[0].out - told[1].out) / 2;
      halves.lost[i] = (told[0].lost - told[1].lost) / 2;
    }
  });
  return halves;
}

}  // namespace scarp
