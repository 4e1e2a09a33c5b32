#include "models/inferred_response.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "models/lobe_response.h"
#include "models/open_response.h"
#include "models/source_parameters.h"
#include "models/speed_question.h"

namespace scarp {

namespace {

std::vector<std::size_t> of_no_peaked_yield(const Lobe& lobe) {
  std::vector<std::size_t> others;
  for (const LobeTally& each : lobe.tallies)
    if (!each.is_peaked) others.push_back(each.tally);
  return others;
}

// The contributions of each peaked yield, and of the rest of each lobe, to speeds.
struct ContributionsApart {
  std::vector<Contribution> to_peaked;
  std::vector<Contribution> to_others;
};

// Whether the speeds of points are sums of these, the former in proportion to their yields. Others,
// as of products and quotients of tallies, are left to the lobes.
std::vector<bool> are_sums(const ContributionsApart& contribution,
                           std::span<const float> contribution_of_all,
                           std::span<const float> speeds) {
  constexpr float nearly = 1e-2F;
  constexpr float rounding = 1e-4F;
  std::vector<bool> sums(speeds.size());
  for (std::size_t p = 0; p < speeds.size(); ++p) {
    float sum = 0;
    float size = std::abs(speeds[p]);
    const auto add = [&](float all) {
      sum += all;
      size = std::max(size, std::abs(all));
    };
    for (const Contribution& other : contribution.to_others) add(other.all[p]);
    for (const Contribution& peaked : contribution.to_peaked) add(peaked.all[p]);
    const bool proportional =
        std::ranges::all_of(contribution.to_peaked, [&](const Contribution& peaked) {
          const float all = peaked.all[p];
          return std::abs(peaked.rise[p] - all) <= nearly * std::abs(all) + rounding * size;
        });
    sums[p] = proportional && std::abs(sum - contribution_of_all[p]) <= rounding * size;
  }
  return sums;
}

// Of speeds that are in proportion to a peaked yield, the amplitude of its factor.
//
// A part of what an open source would bring at the normal comes straight from it; what is more than
// all of it was reflected and does not turn. Where ions only graze, the normal tells little.
std::vector<float> amplitude_of(const Species& ions, const AngularFactor& factor,
                                const SurfacePoints& points, std::span<const float> tally,
                                const Contribution& contribution,
                                const std::vector<bool>& follows) {
  constexpr double grazing = 1e-3;
  const bool is_even = ions.source.map.empty();
  std::vector<float> amplitude(tally.size());
  for (std::size_t p = 0; p < tally.size(); ++p) {
    const float open = factor.value(points.normal[p]);
    if (!follows[p] || !(tally[p] > 0) || open <= grazing * factor.bounds().value) continue;
    amplitude[p] = contribution.all[p] / (is_even ? std::max(open, tally[p]) : open);
  }
  return amplitude;
}

// What is left but for rounding is nothing, and must not let an etch grow.
void take_from(std::vector<float>& rest, std::span<const float> amplitude,
               const AngularFactor& factor, const SurfacePoints& points) {
  constexpr float rounding = 1e-5F;
  for (std::size_t p = 0; p < rest.size(); ++p) {
    const float part = amplitude[p] * factor.value(points.normal[p]);
    rest[p] -= part;
    if (std::abs(rest[p]) <= rounding * std::abs(part)) rest[p] = 0;
  }
}

// The part of the speeds that depends on the normal by each lobe: its contribution to them. Of a
// product of what several lobes bring each of them would take the whole: then they share the
// contribution of all of them together.
std::vector<std::vector<float>> angular_parts(std::span<const std::vector<float>> contribution,
                                              std::span<const float> contribution_of_all) {
  std::vector<std::vector<float>> parts(contribution.begin(), contribution.end());
  for (std::size_t p = 0; p < contribution_of_all.size(); ++p) {
    float together = 0;
    for (const std::vector<float>& part : parts) together += part[p];
    if (!(std::abs(together) > std::abs(contribution_of_all[p]) &&
          together * contribution_of_all[p] > 0))
      continue;
    for (std::vector<float>& part : parts) part[p] *= contribution_of_all[p] / together;
  }
  return parts;
}

}  // namespace

InferredResponse::InferredResponse(const SurfaceModel& model)
    : model_(model), angular_(angular_tallies(model.species())) {}

bool InferredResponse::is_mirror_symmetric(int axis) const {
  return are_mirror_symmetric(model_.species(), axis);
}

std::vector<AngularFactor> InferredResponse::factors() const {
  std::vector<AngularFactor> factors;
  for (const Lobe& lobe : angular_.lobes) {
    const std::vector<AngularFactor> of_lobe = lobe_factors(lobe.direction);
    factors.insert(factors.end(), of_lobe.begin(), of_lobe.end());
  }
  for (const PeakedYield& peaked : angular_.peaked)
    factors.push_back(OpenResponse(peaked.ions, peaked.ions.yields[peaked.yield]).factor());
  return factors;
}

// Peaked yields first: what they leave of the speeds is the lobes'.
std::vector<std::vector<float>> InferredResponse::amplitudes(
    const SurfacePoints& points, std::span<const std::span<const float>> flux,
    std::span<const AngularFactor> factors) const {
  const auto& [lobes, peaked] = angular_;
  const SpeedQuestion question{.model = model_, .points = points, .flux = flux};
  std::vector<std::vector<float>> parts(1 + factors.size());
  std::vector<float>& rest = parts.front() = question.speeds;
  std::vector<bool> sums(points.material.size(), true);
  if (!peaked.empty()) {
    ContributionsApart apart;
    std::vector<std::size_t> all_tallies;
    for (const PeakedYield& yield : peaked) {
      apart.to_peaked.push_back(question.contribution_of({&yield.tally, 1}));
      all_tallies.push_back(yield.tally);
    }
    for (const Lobe& lobe : lobes) {
      const std::vector<std::size_t> others = of_no_peaked_yield(lobe);
      apart.to_others.push_back(question.contribution_of(others));
      all_tallies.insert(all_tallies.end(), others.begin(), others.end());
    }
    sums = are_sums(apart, question.loss(1, all_tallies), question.speeds);
    for (std::size_t k = 0; k < peaked.size(); ++k) {
      const std::size_t place = factors.size() - peaked.size() + k;
      parts[1 + place] = amplitude_of(peaked[k].ions, factors[place], points, flux[peaked[k].tally],
                                      apart.to_peaked[k], sums);
      take_from(rest, parts[1 + place], factors[place], points);
    }
  }
  std::vector<std::vector<float>> contribution;
  for (const Lobe& lobe : lobes) contribution.push_back(contribution_of_lobe(question, lobe, sums));
  std::vector<std::vector<float>> angular_of_lobes = contribution;
  if (lobes.size() > 1) {
    Lobe all_lobes;
    for (const Lobe& lobe : lobes)
      all_lobes.tallies.insert(all_lobes.tallies.end(), lobe.tallies.begin(), lobe.tallies.end());
    angular_of_lobes = angular_parts(contribution, contribution_of_lobe(question, all_lobes, sums));
  }
  std::size_t place = 0;
  for (std::size_t l = 0; l < lobes.size(); ++l) {
    const auto of_lobe = factors.subspan(place, lobe_factor_count);
    for (std::vector<float>& part : lobe_amplitudes(question, lobes[l], of_lobe, sums,
                                                    contribution[l], angular_of_lobes[l], rest))
      parts[1 + place++] = std::move(part);
  }
  return parts;
}

}  // namespace scarp
